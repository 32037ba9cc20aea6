//! Work that is split among threads, if there are any. The result does not depend on their number.
//!
//! With the feature `threads`, calls within a rayon pool use the threads of that pool. Otherwise,
//! all work is sequential.

use std::ops::Range;

/// Pieces of work per thread; more than one, because their durations differ.
const PIECES: usize = 4;

/// Run two closures, in parallel if possible.
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

/// Apply `work` to each item; the results are in the order of the items.
pub fn each<T: Send, R: Send>(mut items: Vec<T>, work: &(impl Fn(T) -> R + Sync)) -> Vec<R> {
    if items.len() < 2 || count_threads() < 2 {
        return items.into_iter().map(work).collect();
    }
    let others = items.split_off(items.len() / 2);
    let (mut done, rest) = both(|| each(items, work), || each(others, work));
    done.extend(rest);
    done
}

/// Apply `work` to each chunk of `size` numbers and its index. Not generic, so that it is compiled
/// only once, which keeps the WebAssembly module small.
pub fn each_chunk(numbers: &mut [f32], size: usize, work: &(dyn Fn(usize, &mut [f32]) + Sync)) {
    let chunks = numbers.chunks_mut(size).enumerate().collect();
    each(chunks, &|(index, chunk)| work(index, chunk));
}

/// Split `count` elements into ranges of at least `least` elements; with one thread, into one
/// range.
pub fn ranges(count: usize, least: usize) -> Vec<Range<usize>> {
    let size = piece(count, least);
    (0..count).step_by(size).map(|first| first..(first + size).min(count)).collect()
}

/// Elements per piece of work, at least `least`; the last piece may be smaller.
pub fn piece(count: usize, least: usize) -> usize {
    let pieces = match count_threads() {
        0 | 1 => 1,
        threads => PIECES * threads,
    };
    ((count + pieces - 1) / pieces).max(least).max(1)
}

/// Number of threads in the pool of the caller.
fn count_threads() -> usize {
    #[cfg(feature = "threads")]
    if rayon::current_thread_index().is_some() {
        return rayon::current_num_threads();
    }
    1
}
