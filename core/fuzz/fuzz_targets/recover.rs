//! Past damage: the frames before it are those that come in order, what is whole has no gap, and
//! gaps lie in the stream, in their order.

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
            continue; // HEAD is not whole
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
