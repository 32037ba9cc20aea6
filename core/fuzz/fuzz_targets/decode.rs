//! Arbitrary bytes, and the same bytes with their framing corrected, decode to the same result in
//! one piece and in many.

#![no_main]

use libfuzzer_sys::fuzz_target;
use quarc_fuzz::decode;
use quarc_fuzz::mend::mend;

fuzz_target!(|data: &[u8]| {
    let piece = data.last().map_or(1, |&last| usize::from(last) + 1);
    for stream in [data, &mend(data)] {
        assert_eq!(decode(stream, usize::MAX), decode(stream, piece));
    }
});
