//! How a BSDF stores closures of more than one type.

use crate::abi::ScatterTable;
use crate::closure::Closure;
use crate::export::ScatterShim;
use crate::math::Vec3;
use crate::operator::{Mode, Scatter, ScatterDraws, ScatterEval, ScatterSample};
use core::marker::PhantomData;

/// Where a BSDF stores the closure of a point.
pub struct Slot<'a> {
    out: *mut Closure,
    room: PhantomData<&'a mut Closure>,
}

/// Proof that a closure was stored.
pub struct Stored(());

impl Slot<'_> {
    /// # Safety
    /// `out` must be valid for writing as long as the slot lives.
    pub(crate) unsafe fn new(out: *mut Closure) -> Self {
        let room = PhantomData;
        Self { out, room }
    }

    /// Stores a closure of any type that fits, together with the functions of that type.
    #[inline(always)]
    pub fn put<C: Scatter + Copy + Send + Sync + 'static>(self, closure: C) -> Stored {
        let table: &'static ScatterTable = const { &ScatterShim::<C>::TABLE };
        // SAFETY: the table is the one made for this closure type; `out` is valid for writing by the contract of `new`.
        unsafe { Closure::store(self.out, table, closure) };
        Stored(())
    }
}

/// The closure of a BSDF that has those of two types, where it is not put into a [`Slot`].
#[derive(Clone, Copy, Debug)]
pub enum Either<A, B> {
    /// One type.
    A(A),
    /// The other.
    B(B),
}

impl<A: Scatter + Copy + Send + Sync + 'static, B: Scatter + Copy + Send + Sync + 'static>
    Either<A, B>
{
    /// Stores the closure itself.
    #[inline(always)]
    pub fn put(&self, slot: Slot<'_>) -> Stored {
        match self {
            Self::A(a) => slot.put(*a),
            Self::B(b) => slot.put(*b),
        }
    }
}

impl<A: Scatter, B: Scatter> Scatter for Either<A, B> {
    fn eval(&self, wo: Vec3, wi: Vec3, mode: Mode) -> ScatterEval {
        match self {
            Self::A(a) => a.eval(wo, wi, mode),
            Self::B(b) => b.eval(wo, wi, mode),
        }
    }

    fn sample(&self, wo: Vec3, u: ScatterDraws, mode: Mode) -> Option<ScatterSample> {
        match self {
            Self::A(a) => a.sample(wo, u, mode),
            Self::B(b) => b.sample(wo, u, mode),
        }
    }

    fn lobes(&self) -> u32 {
        match self {
            Self::A(a) => a.lobes(),
            Self::B(b) => b.lobes(),
        }
    }

    fn eta(&self) -> f32 {
        match self {
            Self::A(a) => a.eta(),
            Self::B(b) => b.eta(),
        }
    }
}
