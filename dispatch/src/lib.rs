//! The kernel at the speed of the host: eq. 8.1 and its derivatives with the vector width chosen at run time, on one thread.
//!
//! `habitus_core` is compiled for the smallest processor of a target; its kernels are inlined here into functions that are compiled once more for
//! wider vectors (`pulp`). Each lane sums in the order of the kernel and no operation is fused, so the bits are those of the kernel,
//! whatever the width. Errors are the kernel's. Without the feature `std` the functions are plain calls of the kernel, for targets without
//! an operating system that could tell the processor.
#![no_std]
#![forbid(unsafe_code)]

use core::ops::Range;

use habitus_core::Error;
use habitus_core::fit::{self, FitOptions, FitReport, Frame, Samples};
use habitus_core::format::Mode;
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::any_prepared::AnyPrepared;
use habitus_core::generator::bilinear::Bilinear;
use habitus_core::generator::prepared::Prepared;
use habitus_core::generator::{At, Block, Generator, NUMBERS, Weights};
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::procrustes::Moments;
use habitus_core::wavelet::{Grid, Wavelet, transform, window};
use habitus_core::workspace::Requirement;

/// A call with its arguments.
trait Call {
    type Output;
    fn call(self) -> Self::Output;
}

/// Defines a function whose body is compiled for every vector width and chosen at run time.
///
/// The body is a method that must be inlined, not a closure: a closure that the compiler leaves alone would keep the narrow width.
macro_rules! dispatched {
    (
        $(#[$attribute:meta])*
        $visible:vis fn $name:ident [$($generics:tt)*] [$($uses:tt)*] ($($argument:ident: $type:ty),* $(,)?) -> $output:ty $body:block
    ) => {
        $(#[$attribute])*
        #[allow(clippy::too_many_arguments)]
        $visible fn $name<$($generics)*>($($argument: $type),*) -> $output {
            struct Arguments<$($generics)*> { $($argument: $type),* }
            impl<$($generics)*> Call for Arguments<$($uses)*> {
                type Output = $output;
                #[inline(always)]
                fn call(self) -> $output {
                    let Arguments { $($argument),* } = self;
                    $body
                }
            }
            widest(Arguments { $($argument),* })
        }
    };
}

/// Runs a call with the widest vectors that pay: 256 bits, or those of the target. Wider ones would help what is bound by arithmetic; they are left out to save build time.
#[cfg(feature = "std")]
#[inline(never)]
fn widest<C: Call>(call: C) -> C::Output {
    struct Within<C>(C);

    impl<C: Call> pulp::NullaryFnOnce for Within<C> {
        type Output = C::Output;

        #[inline(always)]
        fn call(self) -> C::Output {
            self.0.call()
        }
    }

    pulp::Arch::new().dispatch(Within(call))
}

/// Runs a call with the vectors of the target.
#[cfg(not(feature = "std"))]
#[inline(always)]
fn widest<C: Call>(call: C) -> C::Output {
    call.call()
}

dispatched! {
    /// [`Generator::evaluate`] on one thread.
    pub fn evaluate['a, G: Generator]['a, G](
        generator: &'a G,
        weights: Weights<'a>,
        vertices: Range<usize>,
        out: &'a mut [f32],
    ) -> Result<(), Error> {
        generator.evaluate(weights, vertices, out)
    }
}

dispatched! {
    /// [`Generator::linearise`] on one thread: values and Jacobian of a range of blocks, `[block][column][3][16]`.
    pub fn linearise['a, G: Generator]['a, G](
        generator: &'a G,
        weights: Weights<'a>,
        blocks: Range<usize>,
        values: &'a mut [f32],
        jacobian: &'a mut [f32],
    ) -> Result<(), Error> {
        generator.linearise(weights, blocks, values, jacobian)
    }
}

dispatched! {
    /// [`Generator::evaluate_at`] on one thread.
    pub fn evaluate_at['a, G: Generator]['a, G](
        generator: &'a G,
        at: At<'a>,
        vertices: Range<usize>,
        out: &'a mut [f32],
    ) -> Result<(), Error> {
        generator.evaluate_at(at, vertices, out)
    }
}

dispatched! {
    /// [`Generator::evaluate_batch_at`] on one thread.
    pub fn evaluate_batch_at['a, G: Generator]['a, G](
        generator: &'a G,
        ats: &'a [At<'a>],
        vertices: Range<usize>,
        out: &'a mut [f32],
    ) -> Result<(), Error> {
        generator.evaluate_batch_at(ats, vertices, out)
    }
}

dispatched! {
    /// [`Generator::linearise_at`] on one thread.
    pub fn linearise_at['a, G: Generator]['a, G](
        generator: &'a G,
        at: At<'a>,
        blocks: Range<usize>,
        values: &'a mut [f32],
        jacobian: &'a mut [f32],
    ) -> Result<(), Error> {
        generator.linearise_at(at, blocks, values, jacobian)
    }
}

dispatched! {
    /// [`Generator::block_unchecked`].
    fn evaluated_block['a, G: Generator]['a, G](generator: &'a G, at: At<'a>, block: usize) -> Option<Block> {
        generator.block_unchecked(at, block)
    }
}

dispatched! {
    /// [`Generator::linearised_block_unchecked`].
    fn linearised_block['a, G: Generator]['a, G](
        generator: &'a G,
        at: At<'a>,
        block: usize,
        jacobian: &'a mut [[f32; NUMBERS]],
    ) -> Option<Block> {
        generator.linearised_block_unchecked(at, block, jacobian)
    }
}

dispatched! {
    /// [`AnyGenerator::prepared`] on one thread.
    pub fn any_prepared['a, 'm: 'w, 'w]['a, 'm, 'w](
        generator: &'a AnyGenerator<'m>,
        fixed: Mode,
        weights: &'a [f32],
        blocks: Range<usize>,
        workspace: &'w mut [f32],
    ) -> Result<AnyPrepared<'w, 'm>, Error>
    {
        generator.prepared(fixed, weights, blocks, workspace)
    }
}

dispatched! {
    /// [`Prepared::new`] on one thread; the result is evaluated by [`evaluate`] and [`linearise`].
    pub fn prepared['a, 'm, 'w]['a, 'm, 'w](
        generator: &'a Bilinear<'m>,
        fixed: Mode,
        weights: &'a [f32],
        blocks: Range<usize>,
        workspace: &'w mut [f32],
    ) -> Result<Prepared<'w>, Error> {
        Prepared::new(generator, fixed, weights, blocks, workspace)
    }
}

dispatched! {
    /// [`fit::normal_equations()`] on one thread: its sums over samples have one order.
    pub fn normal_equations['a, G: Generator, S: Samples + ?Sized]['a, G, S](
        generator: &'a G,
        weights: Weights<'a>,
        samples: &'a S,
        placement: &'a Similarity<f32>,
        frame: Frame,
        jtj: &'a mut [f32],
        jtr: &'a mut [f32],
        workspace: &'a mut [f32],
    ) -> Result<f32, Error> {
        fit::normal_equations(generator, weights, samples, placement, frame, jtj, jtr, workspace)
    }
}

dispatched! {
    /// [`fit::fit_points()`] on one thread.
    pub fn fit_points['a, 'p, G: Generator, S: Samples + ?Sized]['a, 'p, G, S](
        generator: &'a G,
        samples: &'a S,
        options: &'a FitOptions<'p>,
        identity: &'a mut [f32],
        pose: &'a mut [f32],
        placement: &'a mut Similarity<f32>,
        workspace: &'a mut [f32],
    ) -> Result<FitReport, Error> {
        fit::fit_points(generator, samples, options, identity, pose, placement, workspace)
    }
}

dispatched! {
    /// [`Moments::add_all`] of new moments on one thread.
    pub fn moments['a]['a](sources: &'a [[f32; 3]], targets: &'a [[f32; 3]]) -> Result<Moments<f32>, Error> {
        let mut moments = Moments::new();
        moments.add_all(sources, targets)?;
        Ok(moments)
    }
}

dispatched! {
    /// [`transform::synthesis`] on one thread.
    pub fn wavelet_synthesis['a]['a](
        grid: &'a Grid,
        wavelet: Wavelet,
        level: usize,
        coefficients: &'a [f32],
        out: &'a mut [f32],
        workspace: &'a mut [f32],
    ) -> Result<(), Error> {
        transform::synthesis(grid, wavelet, level, coefficients, out, workspace)
    }
}

dispatched! {
    /// [`window::window`] on one thread.
    pub fn wavelet_window['a]['a](
        grid: &'a Grid,
        wavelet: Wavelet,
        level: usize,
        columns: Range<usize>,
        rows: Range<usize>,
        coefficients: &'a [f32],
        out: &'a mut [f32],
        workspace: &'a mut [f32],
    ) -> Result<(), Error> {
        window::window(grid, wavelet, level, columns, rows, coefficients, out, workspace)
    }
}

/// A generator whose kernels are called and choose the width of their vectors themselves.
///
/// For long calls over generators of any kind, such as fits and derivatives: with the kernels of every kind and storage inside, each would be half a
/// megabyte. The choice costs some nanoseconds a block of vertices.
#[derive(Debug, Clone, Copy)]
pub struct Blockwise<'g, G>(pub &'g G);

impl<G: Generator> Generator for Blockwise<'_, G> {
    fn vertex_count(&self) -> usize {
        self.0.vertex_count()
    }

    fn identity_dim(&self) -> usize {
        self.0.identity_dim()
    }

    fn pose_dim(&self) -> usize {
        self.0.pose_dim()
    }

    fn state_req(&self, derivatives: bool) -> Requirement {
        self.0.state_req(derivatives)
    }

    fn write_state(&self, weights: Weights<'_>, derivatives: bool, state: &mut [f32]) {
        self.0.write_state(weights, derivatives, state);
    }

    #[inline(never)]
    fn block_unchecked(&self, at: At<'_>, block: usize) -> Option<Block> {
        evaluated_block(self.0, at, block)
    }

    #[inline(never)]
    fn linearised_block_unchecked(&self, at: At<'_>, block: usize, jacobian: &mut [[f32; NUMBERS]]) -> Option<Block> {
        linearised_block(self.0, at, block, jacobian)
    }

    #[inline(never)]
    fn vertex_unchecked(&self, at: At<'_>, vertex: usize) -> Option<[f32; 3]> {
        self.0.vertex_unchecked(at, vertex)
    }

    #[inline(never)]
    fn linearised_vertex_unchecked(&self, at: At<'_>, vertex: usize, jacobian: &mut [[f32; 3]]) -> Option<[f32; 3]> {
        self.0.linearised_vertex_unchecked(at, vertex, jacobian)
    }
}
