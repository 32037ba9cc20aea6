//! Work that is shared out among threads, where there are any; what comes of it is the same.
//!
//! With the feature `threads`, what is called within a pool of rayon is done by the threads of
//! that pool. All else is done one thing after the other.

use std::ops::Range;

/// Pieces of work for each thread: more than one, as no two take equally long.
const PIECES: usize = 4;

/// Do two things.
pub fn both<A: Send, B: Send>(
    one: impl FnOnce() -> A + Send,
    other: impl FnOnce() -> B + Send,
) -> (A, B) {
    #[cfg(feature = "threads")]
    if count_threads() > 1 {
        return rayon::join(one, other);
    }
    (one(), other())
}

/// Do the same with each of some items; the results stand in the order of the items.
pub fn each<T: Send, R: Send>(mut items: Vec<T>, work: &(impl Fn(T) -> R + Sync)) -> Vec<R> {
    if items.len() < 2 || count_threads() < 2 {
        return items.into_iter().map(work).collect();
    }
    let others = items.split_off(items.len() / 2);
    let (mut done, rest) = both(|| each(items, work), || each(others, work));
    done.extend(rest);
    done
}

/// Cut so many elements into ranges that are worth a piece of work each: all of them into one
/// where there is one thread.
pub fn ranges(count: usize, least: usize) -> Vec<Range<usize>> {
    let size = piece(count, least);
    (0..count).step_by(size).map(|first| first..(first + size).min(count)).collect()
}

/// How many of so many elements make a piece of work, the last piece aside: no fewer than `least`.
pub fn piece(count: usize, least: usize) -> usize {
    let pieces = match count_threads() {
        0 | 1 => 1,
        threads => PIECES * threads,
    };
    ((count + pieces - 1) / pieces).max(least).max(1)
}

/// How many threads share the work of who calls.
fn count_threads() -> usize {
    #[cfg(feature = "threads")]
    if rayon::current_thread_index().is_some() {
        return rayon::current_num_threads();
    }
    1
}
