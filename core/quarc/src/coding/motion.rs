//! The symbols of the anchors of a frame: SPEC 8.7.
//!
//! Levels are coded from coarse to fine. For each anchor, a bit states whether it moves; for those
//! that do, and for each channel, whether the symbol is not 0; then follow the signs and the unary
//! magnitudes of the nonzero symbols.

use super::channels::{
    add, ahead_class, expected_class, magnitude, parent_class, sign_context, subtract, Channels,
    TRANSLATION_CHANNELS,
};
use super::counts::{Counts, Model};
use super::planes::{PlaneReader, PlaneWriter, Planes};
use crate::constants::LEVEL_COUNT_LIMIT;
use crate::error::{Error, Result};
use crate::parallel::both;
use crate::records::Section;

/// Maximum magnitude of a symbol.
pub const SYMBOL_LIMIT: i16 = MAGNITUDE_PLANES + 1;

const MAGNITUDE_PLANES: i16 = 64;

// The contexts of a level, model after model.
const MOVES: usize = 0;
const NOT_ZERO: [usize; 3] = [20, 36, 52]; // of translation, w, rotation
const SIGN: usize = 68;
const MAGNITUDE: usize = 77;
const LEVEL_CONTEXTS: usize = 110;

/// What encoder and decoder know about the anchors of a level before their symbols.
#[derive(Debug, Default)]
pub struct Known {
    /// For each anchor, the motion of its own Gaussian in the previous frame.
    pub own: Vec<Channels>,
    /// For each anchor, the index of its parent in the next coarser level.
    pub parents: Vec<u32>,
}

/// Access to the anchors of all levels; level 1, the finest, has number 0.
pub struct MotionContext<'a> {
    /// The number of anchors of each level.
    pub sizes: Vec<usize>,
    /// Returns what is known about the level finer than the given one, if there is one. Called
    /// before the coarsest level, with the number of levels, and then with each level while its
    /// symbols are coded, when it is known which of its anchors move.
    ///
    /// The slice marks the anchors that matter: those that move, and those of coarser levels than
    /// level 1 with motion above them. An anchor whose parent is not marked may get the index of
    /// any other such parent, or an index past the end.
    pub pass: &'a mut (dyn FnMut(usize, &[bool]) -> Known + Send),
}

/// Contexts of motion in their initial state.
#[must_use]
pub fn motion_counts() -> Counts {
    Counts::new(LEVEL_COUNT_LIMIT * LEVEL_CONTEXTS)
}

/// Encode the symbols of a frame, per level; level 1, the finest, is first.
///
/// # Errors
/// `Encode`: a symbol exceeds `SYMBOL_LIMIT`, or the symbols do not match these anchors.
pub fn write_motion(
    context: &mut MotionContext<'_>,
    symbols: &[Vec<Channels>],
    channels: usize,
    counts: &Counts,
) -> Result<Section> {
    require_valid(symbols, context.sizes.iter().copied(), channels)?;
    let mut writer = PlaneWriter::new(counts.clone());
    walk(&mut writer, context, &mut symbols.to_vec(), channels)?;
    Ok(writer.section())
}

/// Check the symbols of levels with these numbers of anchors.
pub(crate) fn require_valid(
    symbols: &[Vec<Channels>],
    sizes: impl Iterator<Item = usize>,
    channels: usize,
) -> Result<()> {
    let is_valid = |symbols: &Channels| {
        symbols.iter().all(|symbol| symbol.unsigned_abs() <= SYMBOL_LIMIT as u16)
            && symbols[channels..].iter().all(|&symbol| symbol == 0)
    };
    let mut moving = symbols.iter().flatten().filter(|symbols| symbols != &&Channels::default());
    if sizes.eq(symbols.iter().map(Vec::len)) && moving.all(is_valid) {
        return Ok(());
    }
    let message =
        format!("a symbol exceeds {SYMBOL_LIMIT}, or the symbols do not match the anchors");
    Err(Error::Encode(message))
}

/// Decode the symbols of a frame, per level; level 1, the finest, is first.
///
/// # Errors
/// Those of reading the section.
pub fn read_motion(
    section: &Section,
    context: &mut MotionContext<'_>,
    channels: usize,
    counts: &mut Counts,
) -> Result<Vec<Vec<Channels>>> {
    let mut symbols: Vec<Vec<Channels>> =
        context.sizes.iter().map(|&count| vec![Channels::default(); count]).collect();
    let mut reader = PlaneReader::new(section, counts)?;
    walk(&mut reader, context, &mut symbols, channels)?;
    reader.finish()?;
    Ok(symbols)
}

fn walk<P: Planes>(
    planes: &mut P,
    context: &mut MotionContext<'_>,
    symbols: &mut [Vec<Channels>],
    channels: usize,
) -> Result<()> {
    // The coarsest level has no parents and no motion above it.
    let mut above = Done { sums: Vec::new(), classes: Vec::new() };
    let mut known = (context.pass)(symbols.len(), &[]);
    for (number, symbols) in symbols.iter_mut().enumerate().rev() {
        let Known { own, parents } = &known;
        let first = number * LEVEL_CONTEXTS;
        let mut level = Level { planes, first, channels, own, parents, above: &above };
        let moves = level.code_moves(symbols)?;
        let matters = if number > 0 { level.matters(&moves) } else { moves.clone() };
        // Entropy decoding is serial; at the same time, other threads search.
        let code = || level.code_moving(&moves, symbols);
        let (coded, next) = both(code, || (context.pass)(number, &matters));
        coded?;
        if number > 0 {
            above = above.and_then(parents, symbols);
        }
        known = next;
    }
    Ok(())
}

/// What the anchors of a level pass on to their children in the next finer level.
struct Done {
    /// Their symbols plus the motion accumulated from their parents.
    sums: Vec<Channels>,
    /// The class P of their own symbols.
    classes: Vec<u8>,
}

impl Done {
    /// The accumulated motion of a parent, and its class.
    fn at(&self, parent: u32) -> (Channels, u8) {
        let parent = parent as usize;
        match (self.sums.get(parent), self.classes.get(parent)) {
            (Some(&sum), Some(&class)) => (sum, class),
            _ => (Channels::default(), 0),
        }
    }

    fn and_then(&self, parents: &[u32], symbols: &[Channels]) -> Done {
        let sum = |(&parent, own): (&u32, &Channels)| add(&self.at(parent).0, own);
        Done {
            sums: parents.iter().zip(symbols).map(sum).collect(),
            classes: symbols.iter().map(|own| parent_class(magnitude(own))).collect(),
        }
    }
}

/// Walk a level through its planes.
struct Level<'a, P> {
    planes: &'a mut P,
    first: usize,
    channels: usize,
    own: &'a [Channels],
    parents: &'a [u32],
    above: &'a Done,
}

impl<P: Planes> Level<'_, P> {
    /// Code the symbols of the moving anchors: planes 2 to 4.
    fn code_moving(&mut self, moves: &[bool], symbols: &mut [Channels]) -> Result<()> {
        let moving = moves.iter().enumerate().filter(|(_, &moves)| moves);
        let moving: Vec<u32> = moving.map(|(anchor, _)| anchor as u32).collect();
        let expected: Vec<Channels> = moving.iter().map(|&anchor| self.expected(anchor)).collect();
        let there = self.code_not_zero(&moving, &expected, symbols)?;
        self.code_signed(&there, &expected, &moving, symbols)
    }

    /// Which anchors have values that their children use.
    fn matters(&self, moves: &[bool]) -> Vec<bool> {
        let is_still = |&parent: &u32| self.above.at(parent).0 == Channels::default();
        moves.iter().zip(self.parents).map(|(&moves, parent)| moves || !is_still(parent)).collect()
    }

    /// The anchor's own previous motion minus the motion accumulated so far.
    fn expected(&self, anchor: u32) -> Channels {
        let parent = self.parents[anchor as usize];
        subtract(&self.own[anchor as usize], &self.above.at(parent).0)
    }

    /// Code which anchors move: plane 1.
    fn code_moves(&mut self, symbols: &[Channels]) -> Result<Vec<bool>> {
        let context = |(own, &parent): (&Channels, &u32)| {
            let (done, class) = self.above.at(parent);
            u16::from(5 * class + expected_class(magnitude(&subtract(own, &done))))
        };
        let contexts: Vec<u16> = self.own.iter().zip(self.parents).map(context).collect();
        let mut moves = P::known(symbols, |own| own != &Channels::default());
        self.planes.code(Model::at(self.first + MOVES), &contexts, &mut moves)?;
        Ok(moves)
    }

    /// Code which symbols of the moving anchors are not 0 (planes 2, channel by channel), and
    /// return them as channel and index among these anchors.
    fn code_not_zero(
        &mut self,
        moving: &[u32],
        expected: &[Channels],
        symbols: &[Channels],
    ) -> Result<Vec<(usize, u32)>> {
        let mut there = Vec::new();
        let mut so_far = vec![0u16; moving.len()];
        for channel in 0..self.channels {
            let context = |(expected, &so_far): (&Channels, &u16)| {
                4 * expected[channel].unsigned_abs().min(3) + so_far.min(3)
            };
            let contexts: Vec<u16> = expected.iter().zip(&so_far).map(context).collect();
            let mut bits = P::known(moving, |&anchor| symbols[anchor as usize][channel] != 0);
            let model = Model::at(self.first + NOT_ZERO[self.kind(channel)]);
            self.planes.code(model, &contexts, &mut bits)?;
            for (place, (&bit, so_far)) in bits.iter().zip(&mut so_far).enumerate() {
                *so_far += u16::from(bit);
                if bit {
                    there.push((channel, place as u32));
                }
            }
        }
        Ok(there)
    }

    /// The kind of a channel: translation, w or rotation.
    fn kind(&self, channel: usize) -> usize {
        if channel < TRANSLATION_CHANNELS {
            0
        } else if self.channels > 6 && channel == TRANSLATION_CHANNELS {
            1
        } else {
            2
        }
    }

    /// Code the nonzero symbols: planes 3 and 4.
    fn code_signed(
        &mut self,
        there: &[(usize, u32)],
        expected: &[Channels],
        moving: &[u32],
        symbols: &mut [Channels],
    ) -> Result<()> {
        let value_of =
            |&(channel, place): &(usize, u32)| symbols[moving[place as usize] as usize][channel];
        let mut ahead: Vec<i16> =
            there.iter().map(|&(channel, place)| expected[place as usize][channel]).collect();
        let contexts: Vec<u16> = ahead.iter().map(|&expected| sign_context(expected)).collect();
        let mut negative = P::known(there, |symbol| value_of(symbol) < 0);
        self.planes.code(Model::at(self.first + SIGN), &contexts, &mut negative)?;
        for (ahead, _) in ahead.iter_mut().zip(&negative).filter(|(_, &negative)| negative) {
            *ahead = -*ahead;
        }
        let magnitudes =
            self.code_magnitudes(&ahead, |symbol| value_of(&there[symbol as usize]))?;
        let signed = magnitudes.into_iter().zip(negative);
        for (&(channel, place), (magnitude, negative)) in there.iter().zip(signed) {
            let symbol = &mut symbols[moving[place as usize] as usize][channel];
            *symbol = if negative { -magnitude } else { magnitude };
        }
        Ok(())
    }

    /// Code magnitudes, in contexts of the magnitude expected in their direction.
    fn code_magnitudes(
        &mut self,
        ahead: &[i16],
        value_of: impl Fn(u32) -> i16,
    ) -> Result<Vec<i16>> {
        let mut magnitudes = vec![1; ahead.len()];
        let mut left: Vec<u32> = (0..ahead.len() as u32).collect();
        for plane in 0..MAGNITUDE_PLANES {
            if left.is_empty() {
                break;
            }
            let model = 11 * plane.min(2) as u16;
            let context = |&symbol: &u32| model + ahead_class(ahead[symbol as usize] - plane);
            let contexts: Vec<u16> = left.iter().map(context).collect();
            let mut above = P::known(&left, |&symbol| value_of(symbol).abs() > plane + 1);
            self.planes.code(Model::at(self.first + MAGNITUDE), &contexts, &mut above)?;
            let mut answers = above.iter();
            left.retain(|_| answers.next() == Some(&true));
            for &symbol in &left {
                magnitudes[symbol as usize] += 1;
            }
        }
        Ok(magnitudes)
    }
}
