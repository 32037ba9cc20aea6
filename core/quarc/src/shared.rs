//! Arrays that successive states share until one of them changes.

use std::ops::Deref;
use std::sync::Arc;

/// An array of a state.
#[derive(Clone, Debug)]
pub struct Shared<T> {
    now: Arc<T>,
    earlier: Earlier<T>,
}

impl<T: Clone + Default> Shared<T> {
    /// An array of the first state.
    pub fn new(array: T) -> Self {
        Shared { now: Arc::new(array), earlier: Earlier::new() }
    }

    /// The array, shared with clones of the state.
    pub const fn arc(&self) -> &Arc<T> {
        &self.now
    }

    /// The array to be changed, a copy if it is shared.
    pub fn make_mut(&mut self) -> &mut T {
        self.change(|_| (), |now, copy| copy.clone_from(now));
        self.own()
    }

    /// Change the array by `in_place`, or if it is shared replace it by what `copy` makes of it in
    /// an array with any contents.
    pub fn change(&mut self, in_place: impl FnOnce(&mut T), copy: impl FnOnce(&T, &mut T)) {
        if Arc::strong_count(&self.now) == 1 {
            return in_place(self.own());
        }
        let mut next = self.earlier.take_unused().unwrap_or_default();
        copy(&self.now, &mut next);
        self.earlier.keep(std::mem::replace(&mut self.now, Arc::new(next)));
    }

    /// The array of this state alone. It moves to a new place, so that the weak pointers of a
    /// dequantizer no longer find it.
    fn own(&mut self) -> &mut T {
        let array = Arc::try_unwrap(std::mem::take(&mut self.now));
        self.now = Arc::new(array.ok().expect("no other state has the array"));
        Arc::get_mut(&mut self.now).expect("the array is new")
    }
}

impl<T> Deref for Shared<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.now
    }
}

pub use earlier::Earlier;

/// The arrays of earlier states of a stream. Those that no state uses any more are written again:
/// if they were freed, each frame would have to map and clear new memory.
#[cfg(not(target_arch = "wasm32"))]
mod earlier {
    use std::sync::{Arc, Mutex, PoisonError};

    /// Maximum number of arrays, more than a player has states in use.
    const MAX_ARRAYS: usize = 8;

    /// Arrays of earlier states, oldest first.
    #[derive(Clone, Debug)]
    pub struct Earlier<T>(Arc<Mutex<Vec<Arc<T>>>>);

    impl<T> Earlier<T> {
        pub fn new() -> Self {
            Earlier(Arc::default())
        }

        /// An array that no state uses any more.
        pub fn take_unused(&self) -> Option<T> {
            let mut arrays = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let unused = arrays.iter().position(|array| Arc::strong_count(array) == 1)?;
            Arc::try_unwrap(arrays.remove(unused)).ok()
        }

        /// Keep an array that a state has replaced.
        pub fn keep(&self, array: Arc<T>) {
            let mut arrays = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if arrays.len() == MAX_ARRAYS {
                arrays.remove(0);
            }
            arrays.push(array);
        }
    }
}

/// WebAssembly never returns memory, so that its allocator writes unused arrays again.
#[cfg(target_arch = "wasm32")]
mod earlier {
    use std::marker::PhantomData;
    use std::sync::Arc;

    /// No arrays.
    #[derive(Clone, Debug)]
    pub struct Earlier<T>(PhantomData<T>);

    impl<T> Earlier<T> {
        pub const fn new() -> Self {
            Earlier(PhantomData)
        }

        #[allow(clippy::unused_self)]
        pub const fn take_unused(&self) -> Option<T> {
            None
        }

        #[allow(clippy::unused_self)]
        pub fn keep(&self, array: Arc<T>) {
            drop(array);
        }
    }
}
