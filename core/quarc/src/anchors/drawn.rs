//! The chosen anchors of a level, in Morton order and by number.

use super::index::{Index, NOWHERE};
use super::order::Order;
use super::runs::LANES;

/// The anchors of a level.
pub struct Drawn {
    /// Indices of the chosen Gaussians, ascending, which define the numbers of the anchors.
    pub indices: Vec<u32>,
    /// Their search index.
    pub index: Index,
    /// For each anchor of the index, the place of its Gaussian in Morton order.
    pub places: Vec<u32>,
}

impl Drawn {
    /// The level with the anchors at these ascending places of the order.
    pub fn new(chosen: &[u32], order: &Order) -> Self {
        let (indices, numbers_of) = number(chosen, &order.indices);
        let mut places: Vec<u32> = Vec::with_capacity(chosen.len());
        let mut numbers = Vec::with_capacity(chosen.len());
        let mut merges = Vec::with_capacity(chosen.len());
        let mut before = None;
        for (&place, &number) in chosen.iter().zip(&numbers_of) {
            let merge = before.map_or(order.merges[0], |before| order.merge_with(before, place));
            before = Some(place);
            // Of anchors at one position, only the first, with the least number, has followers.
            if merge > 0 {
                places.push(place);
                numbers.push(number);
                merges.push(merge);
            }
        }
        let gather = |axis: usize| {
            let mut row: Vec<f32> = Vec::with_capacity(places.len() + LANES);
            row.extend(places.iter().map(|&place| order.points[axis][place as usize]));
            row.resize(places.len() + LANES, NOWHERE);
            row
        };
        let index = Index::new([gather(0), gather(1), gather(2)], numbers, &merges);
        Drawn { indices, index, places }
    }
}

/// The indices of the Gaussians at some places of an order, ascending, and for each place the
/// position of its Gaussian in that sequence.
fn number(chosen: &[u32], order: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut members = vec![0_u64; order.len() / 64 + 1];
    for &place in chosen {
        let index = order[place as usize];
        members[index as usize / 64] |= 1 << (index % 64);
    }
    let (mut before, mut indices) = (Vec::with_capacity(members.len()), vec![0; chosen.len()]);
    let mut found = 0;
    for (word, &bits) in members.iter().enumerate() {
        before.push(found as u32);
        let mut rest = bits;
        while rest != 0 {
            indices[found] = (64 * word) as u32 + rest.trailing_zeros();
            rest &= rest - 1;
            found += 1;
        }
    }
    let number = |&place: &u32| {
        let index = order[place as usize];
        let (word, bit) = (index as usize / 64, 1_u64 << (index % 64));
        before[word] + (members[word] & (bit - 1)).count_ones()
    };
    (indices, chosen.iter().map(number).collect())
}
