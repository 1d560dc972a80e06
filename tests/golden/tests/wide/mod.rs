//! The core inside wrappers for wider vectors, as `habitus-dispatch` calls it; for tests and for the example `figures`.

use habitus_golden::{Backend, Kernel};

/// A kernel as pulp takes it.
struct Inside<K>(K);

impl<K: Kernel> pulp::NullaryFnOnce for Inside<K> {
    type Output = K::Output;

    #[inline(always)]
    fn call(self) -> K::Output {
        self.0.call()
    }
}

/// The core inside a wrapper for 256-bit vectors.
pub struct Avx2(pub pulp::x86::V3);

impl Backend for Avx2 {
    #[inline(always)]
    fn within<K: Kernel>(&self, kernel: K) -> K::Output {
        self.0.vectorize(Inside(kernel))
    }
}
