//! Any bytes, and what they are once their framing is right: in one piece or in many, the same
//! comes of them.

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
