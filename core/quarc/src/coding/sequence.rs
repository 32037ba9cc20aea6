//! Forms and models of sequences of integers: SPEC 8.4.

/// Bits of the class of most numbers.
pub const CLASS_BITS: u32 = 4;
/// Bits of the class of a difference of ascending numbers.
pub const KEY_CLASS_BITS: u32 = 6;

pub(super) const MODELLED_BITS: u32 = 2;

/// The form of the numbers of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Fixed,
    Unsigned,
    Signed,
}

/// The models of a sequence of numbers, its form and its width.
#[derive(Clone, Copy, Debug)]
pub struct Sequence {
    pub(super) form: Form,
    pub(super) width: u32,
    pub(super) class: usize,
    pub(super) sign: usize,
    pub(super) mantissa: usize,
    end: usize,
}

impl Sequence {
    /// A sequence of numbers below 2^`width`, in `outer` outer contexts.
    ///
    /// Here and below, `first` is the index in [`super::counts::Counts`] of the first context of
    /// the sequence.
    #[must_use]
    pub const fn fixed(first: usize, outer: usize, width: u32) -> Self {
        let end = first + (outer << width);
        Sequence { form: Form::Fixed, width, class: first, sign: end, mantissa: end, end }
    }

    /// A sequence of nonnegative numbers whose bit lengths have `width` bits.
    #[must_use]
    pub const fn unsigned(first: usize, outer: usize, width: u32) -> Self {
        let mantissa = first + (outer << width);
        let end = mantissa + (outer << (width + MODELLED_BITS));
        Sequence { form: Form::Unsigned, width, class: first, sign: mantissa, mantissa, end }
    }

    /// A sequence of signed numbers whose magnitudes have bit lengths of `width` bits.
    #[must_use]
    pub const fn signed(first: usize, outer: usize, width: u32) -> Self {
        let sign = first + (outer << width);
        let mantissa = sign + (outer << width);
        let end = mantissa + (outer << (width + MODELLED_BITS + 1));
        Sequence { form: Form::Signed, width, class: first, sign, mantissa, end }
    }

    /// The end of the contexts, at which those of the next sequence may begin.
    #[must_use]
    pub const fn end(&self) -> usize {
        self.end
    }
}
