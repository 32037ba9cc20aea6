//! Modified streams in byte ranges, through calls in any order, cause no crash and no endless requests.

mod numbers;

use numbers::Numbers;
use quarc_capi::*;
use std::fs;
use std::mem::MaybeUninit;
use std::path::Path;
use std::ptr::null_mut;

const STREAMS: [&str; 4] =
    ["journey", "snapshots-journey", "journey-without-index", "cameras-and-metadata"];
const TIMES: usize = 1000;
const MAX_CALLS: usize = 5000;

impl Numbers {
    /// A piece of the stream from here on, of any length up to a bound.
    fn piece<'a>(&mut self, stream: &'a [u8], begin: usize, bound: usize) -> &'a [u8] {
        let rest = &stream[begin.min(stream.len())..];
        &rest[..rest.len().min(1 + self.below(bound))]
    }

    fn change(&mut self, stream: &mut Vec<u8>) {
        for _ in 0..self.below(3) {
            let place = self.below(stream.len());
            match self.below(3) {
                0 => stream[place] ^= 1 << self.below(8),
                1 => stream.truncate(place + 1),
                _ => drop(stream.drain(place..(place + 40).min(stream.len() - 1).max(place))),
            }
        }
    }
}

/// Any call but a pull.
unsafe fn call(decoder: *mut DecoderHandle, stream: &[u8], numbers: &mut Numbers) -> i32 {
    let mut sections = 0;
    let mut state = MaybeUninit::<StateView>::uninit();
    match numbers.below(4) {
        0 => quarc_preview(decoder, state.as_mut_ptr(), &mut sections),
        1 => quarc_index(decoder, [0; 2].as_mut_ptr(), [0; 8].as_mut_ptr(), numbers.below(9)),
        2 => {
            let begin = numbers.below(stream.len());
            let piece = numbers.piece(stream, begin, 200);
            quarc_put(decoder, begin as u64, piece.as_ptr(), piece.len())
        }
        _ => quarc_limit(decoder, stream.len() as u64),
    }
}

/// Pull until the end, with other calls between the pulls; the last status.
unsafe fn read_ranges(stream: &[u8], start: u32, numbers: &mut Numbers) -> i32 {
    let mut decoder = quarc_open_parts(start);
    let mut status = QUARC_OK;
    for _ in 0..MAX_CALLS {
        while numbers.below(2) == 0 {
            assert!(call(decoder, stream, numbers) >= QUARC_OK);
        }
        status = quarc_pull(decoder, null_mut());
        if status != QUARC_OK && status != QUARC_FRAME {
            break;
        }
        let mut range = [0; 2];
        if status == QUARC_OK && quarc_missing(decoder, range.as_mut_ptr()) == QUARC_OK {
            assert!(range[0] < range[1]);
            let piece = numbers.piece(stream, range[0] as usize, (range[1] - range[0]) as usize);
            quarc_put(decoder, range[0], piece.as_ptr(), piece.len());
        }
    }
    quarc_close(&mut decoder);
    status
}

#[test]
fn arbitrary_calls_cause_no_crash() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../conformance/streams");
    let read = |name| fs::read(folder.join(name).with_extension("quarc")).expect("the suite");
    let streams = STREAMS.map(read);
    let mut numbers = Numbers::new();
    let mut ends = [0; 2];
    for time in 0..TIMES {
        let mut stream = streams[time % STREAMS.len()].clone();
        numbers.change(&mut stream);
        let start = [0, 1, 3, 8, u32::MAX][numbers.below(5)];
        match unsafe { read_ranges(&stream, start, &mut numbers) } {
            QUARC_END => ends[0] += 1,
            QUARC_REJECTED => ends[1] += 1,
            status => panic!("status {status} with the stream {stream:?}"),
        }
    }
    assert!(ends.iter().all(|&count| count > TIMES / 10), "{ends:?}");
}
