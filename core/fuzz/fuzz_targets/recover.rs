//! Recovery: the frames before the first gap are those of decoding in order, an intact stream has
//! no gaps, and gaps are inside the stream and ascending.

#![no_main]

use libfuzzer_sys::fuzz_target;
use quarc_fuzz::mend::mend;
use quarc_fuzz::{decode, recover, Outcome};

fuzz_target!(|data: &[u8]| {
    for stream in [data, &mend(data)] {
        let all = decode(stream, usize::MAX);
        let (recovered, gaps) = recover(stream);
        let Outcome { frames, ended } = &recovered;
        if frames.is_empty() && gaps.is_empty() {
            assert!(ended.is_err() || all.frames.is_empty());
            continue; // HEAD is damaged
        }
        assert!(frames.starts_with(&all.frames), "{all:?} {recovered:?} {gaps:?}");
        assert!(gaps.is_empty() || all.ended.is_err(), "{gaps:?}");
        let mut end = 0;
        for gap in &gaps {
            assert!(gap.offset >= end, "{gaps:?}");
            end = gap.offset + gap.bytes;
        }
        assert!(end <= stream.len() as u64, "{gaps:?}");
    }
});
