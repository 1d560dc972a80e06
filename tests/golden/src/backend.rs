//! How a kernel is called: directly, or inside a wrapper that lets the compiler use wider vectors.

use core::ops::Range;

use habitus_core::fit::{FitOptions, FitReport, Frame, Samples, fit_landmarks, fit_points, normal_equations};
use habitus_core::format::{Mode, Model};
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::any_prepared::AnyPrepared;
use habitus_core::generator::{At, Block, Generator, NUMBERS, Weights};
use habitus_core::rotation::similarity::Similarity;
use habitus_core::wavelet::transform::synthesis;
use habitus_core::wavelet::{Grid, Wavelet};
use habitus_core::{Error, Real};

/// A call with its arguments. A closure is one; the kernels are types of their own, because only a method can be made to be inlined into its
/// wrapper, and what is not inlined is not compiled for the wrapper's vectors.
#[allow(missing_docs)]
pub trait Kernel {
    type Output;
    fn call(self) -> Self::Output;
}

impl<T, F: FnOnce() -> T> Kernel for F {
    type Output = T;

    #[inline(always)]
    fn call(self) -> T {
        self()
    }
}

macro_rules! kernel {
    ($name:ident [$($lifetime:lifetime)* $($generic:ident: $bound:ident)*]
     ($($argument:ident: $t:ty),* $(,)?) -> $out:ty = $body:expr) => {
        struct $name<$($lifetime,)* $($generic,)*> { $($argument: $t),* }

        impl<$($lifetime,)* $($generic: $bound,)*> Kernel for $name<$($lifetime,)* $($generic,)*> {
            type Output = $out;

            #[inline(always)]
            fn call(self) -> $out {
                let Self { $($argument),* } = self;
                $body
            }
        }
    };
}

kernel!(Evaluate ['a G: Generator]
    (generator: &'a G, at: At<'a>, vertices: Range<usize>, out: &'a mut [f32]) -> Result<(), Error>
    = generator.evaluate_at(at, vertices, out));
kernel!(LinearisedBlock ['a G: Generator]
    (generator: &'a G, at: At<'a>, block: usize, jacobian: &'a mut [[f32; NUMBERS]]) -> Option<Block>
    = generator.linearised_block_unchecked(at, block, jacobian));
kernel!(Preparation ['a 'w]
    (generator: &'a AnyGenerator<'w>, fixed: Mode, weights: &'a [f32], blocks: Range<usize>, workspace: &'w mut [f32])
    -> Result<AnyPrepared<'w, 'w>, Error>
    = generator.prepared(fixed, weights, blocks, workspace));
kernel!(NormalEquations ['a G: Generator S: Samples]
    (
        generator: &'a G,
        weights: Weights<'a>,
        samples: &'a S,
        placement: &'a Similarity<f32>,
        frame: Frame,
        jtj: &'a mut [f32],
        jtr: &'a mut [f32],
        workspace: &'a mut [f32],
    ) -> Result<f32, Error>
    = normal_equations(generator, weights, samples, placement, frame, jtj, jtr, workspace));
kernel!(FitPoints ['a G: Generator S: Samples]
    (
        generator: &'a G,
        samples: &'a S,
        options: &'a FitOptions<'a>,
        identity: &'a mut [f32],
        pose: &'a mut [f32],
        placement: &'a mut Similarity<f32>,
        workspace: &'a mut [f32],
    ) -> Result<FitReport, Error>
    = fit_points(generator, samples, options, identity, pose, placement, workspace));
kernel!(FitLandmarks ['a G: Generator]
    (
        model: &'a Model<'a>,
        generator: &'a G,
        targets: &'a [Option<[f32; 3]>],
        options: &'a FitOptions<'a>,
        identity: &'a mut [f32],
        pose: &'a mut [f32],
        placement: &'a mut Similarity<f32>,
        workspace: &'a mut [f32],
    ) -> Result<FitReport, Error>
    = fit_landmarks(model, generator, targets, options, identity, pose, placement, workspace));

/// A way to call the kernels. The defaults call the core inside [`Backend::within`], whose default is a plain call: override that one to run everything
/// inside a dispatched wrapper, or single kernels to test a wrapper of one's own.
#[allow(clippy::too_many_arguments, missing_docs)]
pub trait Backend {
    /// Calls a kernel.
    #[inline(always)]
    fn within<K: Kernel>(&self, kernel: K) -> K::Output {
        kernel.call()
    }

    #[inline(always)]
    fn evaluate<G: Generator>(
        &self,
        generator: &G,
        at: At<'_>,
        vertices: Range<usize>,
        out: &mut [f32],
    ) -> Result<(), Error> {
        self.within(Evaluate { generator, at, vertices, out })
    }

    #[inline(always)]
    fn linearised_block<G: Generator>(
        &self,
        generator: &G,
        at: At<'_>,
        block: usize,
        jacobian: &mut [[f32; NUMBERS]],
    ) -> Option<Block> {
        self.within(LinearisedBlock { generator, at, block, jacobian })
    }

    #[inline(always)]
    fn linearised_vertex<G: Generator>(
        &self,
        generator: &G,
        at: At<'_>,
        vertex: usize,
        jacobian: &mut [[f32; 3]],
    ) -> Option<[f32; 3]> {
        self.within(|| generator.linearised_vertex_unchecked(at, vertex, jacobian))
    }

    #[inline(always)]
    fn prepared<'w>(
        &self,
        generator: &AnyGenerator<'w>,
        fixed: Mode,
        weights: &[f32],
        blocks: Range<usize>,
        workspace: &'w mut [f32],
    ) -> Result<AnyPrepared<'w, 'w>, Error> {
        self.within(Preparation { generator, fixed, weights, blocks, workspace })
    }

    #[inline(always)]
    fn normal_equations<G: Generator, S: Samples>(
        &self,
        generator: &G,
        weights: Weights<'_>,
        samples: &S,
        placement: &Similarity<f32>,
        frame: Frame,
        jtj: &mut [f32],
        jtr: &mut [f32],
        workspace: &mut [f32],
    ) -> Result<f32, Error> {
        self.within(NormalEquations { generator, weights, samples, placement, frame, jtj, jtr, workspace })
    }

    #[inline(always)]
    fn fit_points<G: Generator, S: Samples>(
        &self,
        generator: &G,
        samples: &S,
        options: &FitOptions<'_>,
        identity: &mut [f32],
        pose: &mut [f32],
        placement: &mut Similarity<f32>,
        workspace: &mut [f32],
    ) -> Result<FitReport, Error> {
        self.within(FitPoints { generator, samples, options, identity, pose, placement, workspace })
    }

    #[inline(always)]
    fn fit_landmarks<G: Generator>(
        &self,
        model: &Model<'_>,
        generator: &G,
        targets: &[Option<[f32; 3]>],
        options: &FitOptions<'_>,
        identity: &mut [f32],
        pose: &mut [f32],
        placement: &mut Similarity<f32>,
        workspace: &mut [f32],
    ) -> Result<FitReport, Error> {
        self.within(FitLandmarks { model, generator, targets, options, identity, pose, placement, workspace })
    }

    #[inline(always)]
    fn wavelet_synthesis(
        &self,
        grid: &Grid,
        wavelet: Wavelet,
        level: usize,
        coefficients: &[f32],
        out: &mut [f32],
        workspace: &mut [f32],
    ) -> Result<(), Error> {
        self.within(|| synthesis(grid, wavelet, level, coefficients, out, workspace))
    }

    #[inline(always)]
    fn cholesky_factor<R: Real>(&self, a: &mut [R], n: usize) -> Result<(), Error> {
        self.within(|| habitus_core::linalg::cholesky::factor_in_place(a, n))
    }

    #[inline(always)]
    fn cholesky_solution<R: Real>(&self, l: &[R], b: &mut [R]) -> Result<(), Error> {
        self.within(|| habitus_core::linalg::cholesky::solve_in_place(l, b))
    }

    #[inline(always)]
    fn eigenpairs<R: Real>(&self, a: &mut [R], vectors: &mut [R], n: usize) -> Result<(), Error> {
        self.within(|| habitus_core::linalg::symmetric_eigen::diagonalise_in_place(a, vectors, n))
    }
}

/// Plain calls.
#[derive(Debug, Clone, Copy, Default)]
pub struct Plain;

impl Backend for Plain {}
