//! The numbers of all channels of motion, and the classes that contexts form of them: SPEC 8.7.

/// A number per channel: translation x, y, z, rotation w if present, rotation x, y, z, then zeros.
pub type Channels = [i16; 8];

/// Number of translation channels; the rotation channels follow them.
pub const TRANSLATION_CHANNELS: usize = 3;

/// The sum per channel.
#[must_use]
pub fn add(one: &Channels, other: &Channels) -> Channels {
    let mut sum = *one;
    sum.iter_mut().zip(other).for_each(|(sum, other)| *sum += other);
    sum
}

pub(super) fn subtract(one: &Channels, other: &Channels) -> Channels {
    let mut rest = *one;
    rest.iter_mut().zip(other).for_each(|(rest, other)| *rest -= other);
    rest
}

/// The sum of the magnitudes over all channels.
#[must_use]
pub fn magnitude(channels: &Channels) -> u16 {
    channels.iter().map(|channel| channel.unsigned_abs()).sum()
}

/// The class P of a sum of magnitudes.
pub(super) fn parent_class(sum: u16) -> u8 {
    [0, 1, 2, 2, 3][usize::from(sum.min(4))]
}

/// The class E of a sum of magnitudes.
pub(super) fn expected_class(sum: u16) -> u8 {
    [0, 1, 2, 2, 3, 3, 3, 3, 4][usize::from(sum.min(8))]
}

pub(super) fn sign_context(expected: i16) -> u16 {
    let class = u16::from(expected_class(expected.unsigned_abs()));
    if expected < 0 {
        4 - class
    } else {
        4 + class
    }
}

/// The class of f - i.
pub(super) fn ahead_class(ahead: i16) -> u16 {
    const LEAST: i16 = -9;
    const CLASSES: [u16; 20] = [0, 1, 1, 1, 1, 1, 2, 2, 3, 4, 5, 6, 7, 8, 8, 9, 9, 9, 9, 10];
    CLASSES[(ahead.clamp(LEAST, 10) - LEAST) as usize]
}
