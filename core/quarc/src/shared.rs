//! Arrays that successive states share until one of them changes.
//!
//! The arrays of states that nobody uses any more are written again: if they were freed, each frame
//! would have to map and clear new memory.

use std::ops::Deref;
use std::sync::{Arc, Mutex, PoisonError};

/// Maximum number of earlier arrays, more than a player has states in use.
const EARLIER: usize = 8;

/// An array of a state.
#[derive(Clone, Debug)]
pub struct Shared<T> {
    now: Arc<T>,
    /// Those of earlier states of the stream, oldest first.
    earlier: Arc<Mutex<Vec<Arc<T>>>>,
}

impl<T: Clone + Default> Shared<T> {
    /// An array of the first state.
    pub fn new(array: T) -> Self {
        Shared { now: Arc::new(array), earlier: Arc::default() }
    }

    /// The array, shared with clones of the state.
    pub const fn arc(&self) -> &Arc<T> {
        &self.now
    }

    /// The array to be changed, a copy if it is shared.
    pub fn make_mut(&mut self) -> &mut T {
        self.change(|_| (), |now, copy| copy.clone_from(now));
        Arc::make_mut(&mut self.now)
    }

    /// Change the array by `in_place`, or if it is shared replace it by what `copy` makes of it in
    /// an array with any contents.
    pub fn change(&mut self, in_place: impl FnOnce(&mut T), copy: impl FnOnce(&T, &mut T)) {
        if Arc::strong_count(&self.now) == 1 {
            return in_place(Arc::make_mut(&mut self.now));
        }
        let mut next = self.take_unused();
        copy(&self.now, &mut next);
        let before = std::mem::replace(&mut self.now, Arc::new(next));
        let mut earlier = self.earlier.lock().unwrap_or_else(PoisonError::into_inner);
        if earlier.len() == EARLIER {
            earlier.remove(0);
        }
        earlier.push(before);
    }

    /// An array that no state uses any more, or an empty one.
    fn take_unused(&self) -> T {
        let mut earlier = self.earlier.lock().unwrap_or_else(PoisonError::into_inner);
        let unused = earlier.iter().position(|array| Arc::strong_count(array) == 1);
        let unused = unused.map(|place| earlier.remove(place));
        unused.and_then(|array| Arc::try_unwrap(array).ok()).unwrap_or_default()
    }
}

impl<T> Deref for Shared<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.now
    }
}
