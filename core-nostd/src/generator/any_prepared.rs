//! A prepared form of whatever generator a model file has.

use core::ops::Range;

use super::any::AnyGenerator;
use super::prepared::{Prepared, prepared_req};
use super::skinned_prepared::FixedIdentity;
use super::wavelet::{Fixed, Multiscale, Stored, with_fixed, with_fixed_req};
use super::{At, Block, Generator, NUMBERS, Weights};
use crate::Error;
use crate::format::{Kind, Mode};
use crate::quantise::{F16, F32, I8};
use crate::workspace::Requirement;

/// The form of an opened model with the weights of one mode fixed, see [`AnyGenerator::prepared`]. The bits are those of the kind's own type.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
#[non_exhaustive]
pub enum AnyPrepared<'w, 'a> {
    /// Linear in the free weights.
    Columns(Prepared<'w>),
    SkinnedF32(FixedIdentity<'w, 'a, F32<'a>>),
    SkinnedF16(FixedIdentity<'w, 'a, F16<'a>>),
    SkinnedI8(FixedIdentity<'w, 'a, I8<'a>>),
    WaveletF32(Multiscale<Fixed<'w, Stored<'a, F32<'a>>>>),
    WaveletF16(Multiscale<Fixed<'w, Stored<'a, F16<'a>>>>),
    WaveletI8(Multiscale<Fixed<'w, Stored<'a, I8<'a>>>>),
}

impl<'a> AnyGenerator<'a> {
    /// Memory of [`AnyGenerator::prepared`].
    ///
    /// Errors: `WrongKind` for a linear model, which has but one mode.
    pub fn prepared_req(&self, fixed: Mode, blocks: &Range<usize>) -> Result<Requirement, Error> {
        Ok(match (self, fixed) {
            (AnyGenerator::BilinearF32(generator), _) => prepared_req(generator, fixed, blocks),
            (AnyGenerator::BilinearF16(generator), _) => prepared_req(generator, fixed, blocks),
            (AnyGenerator::BilinearI8(generator), _) => prepared_req(generator, fixed, blocks),
            (AnyGenerator::SkinnedF32(body), Mode::Identity) => body.with_identity_req(blocks),
            (AnyGenerator::SkinnedF16(body), Mode::Identity) => body.with_identity_req(blocks),
            (AnyGenerator::SkinnedI8(body), Mode::Identity) => body.with_identity_req(blocks),
            (AnyGenerator::SkinnedF32(body), Mode::Pose) => body.with_pose_req(blocks),
            (AnyGenerator::SkinnedF16(body), Mode::Pose) => body.with_pose_req(blocks),
            (AnyGenerator::SkinnedI8(body), Mode::Pose) => body.with_pose_req(blocks),
            (AnyGenerator::WaveletF32(generator), _) => with_fixed_req(generator, fixed),
            (AnyGenerator::WaveletF16(generator), _) => with_fixed_req(generator, fixed),
            (AnyGenerator::WaveletI8(generator), _) => with_fixed_req(generator, fixed),
            _ => return Err(Error::WrongKind { expected: Kind::Bilinear as u32, found: Kind::Linear as u32 }),
        })
    }

    /// Fixes the weights of one mode for the vertices of `blocks`; see [`Prepared::new`], [`Skinned::with_identity`](super::skinned::Skinned::with_identity)
    /// and [`with_fixed`].
    ///
    /// Errors: `WrongKind` for a linear model, `DimensionMismatch`, `NotFinite`, `IndexOutOfRange`, `WorkspaceTooSmall`. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub fn prepared<'w>(
        &self,
        fixed: Mode,
        weights: &[f32],
        blocks: Range<usize>,
        workspace: &'w mut [f32],
    ) -> Result<AnyPrepared<'w, 'a>, Error>
    where
        'a: 'w,
    {
        use AnyPrepared as Form;
        match (self, fixed) {
            (AnyGenerator::BilinearF32(of), _) => {
                Prepared::new(of, fixed, weights, blocks, workspace).map(Form::Columns)
            }
            (AnyGenerator::BilinearF16(of), _) => {
                Prepared::new(of, fixed, weights, blocks, workspace).map(Form::Columns)
            }
            (AnyGenerator::BilinearI8(of), _) => {
                Prepared::new(of, fixed, weights, blocks, workspace).map(Form::Columns)
            }
            (AnyGenerator::SkinnedF32(body), Mode::Identity) => {
                body.with_identity(weights, blocks, workspace).map(Form::SkinnedF32)
            }
            (AnyGenerator::SkinnedF16(body), Mode::Identity) => {
                body.with_identity(weights, blocks, workspace).map(Form::SkinnedF16)
            }
            (AnyGenerator::SkinnedI8(body), Mode::Identity) => {
                body.with_identity(weights, blocks, workspace).map(Form::SkinnedI8)
            }
            (AnyGenerator::SkinnedF32(body), Mode::Pose) => {
                body.with_pose(weights, blocks, workspace).map(Form::Columns)
            }
            (AnyGenerator::SkinnedF16(body), Mode::Pose) => {
                body.with_pose(weights, blocks, workspace).map(Form::Columns)
            }
            (AnyGenerator::SkinnedI8(body), Mode::Pose) => {
                body.with_pose(weights, blocks, workspace).map(Form::Columns)
            }
            (AnyGenerator::WaveletF32(of), _) => {
                with_fixed(of, fixed, weights, &blocks, workspace).map(Form::WaveletF32)
            }
            (AnyGenerator::WaveletF16(of), _) => {
                with_fixed(of, fixed, weights, &blocks, workspace).map(Form::WaveletF16)
            }
            (AnyGenerator::WaveletI8(of), _) => with_fixed(of, fixed, weights, &blocks, workspace).map(Form::WaveletI8),
            _ => Err(Error::WrongKind { expected: Kind::Bilinear as u32, found: Kind::Linear as u32 }),
        }
    }
}

impl AnyPrepared<'_, '_> {
    /// The group of weights that is still free.
    pub fn free(&self) -> Mode {
        match self {
            AnyPrepared::Columns(form) => form.free(),
            AnyPrepared::WaveletF32(form) => form.locals().free(),
            AnyPrepared::WaveletF16(form) => form.locals().free(),
            AnyPrepared::WaveletI8(form) => form.locals().free(),
            _ => Mode::Pose,
        }
    }

    /// Number of joints of a body whose identity is fixed; 0 for other forms, which have none.
    pub fn n_joints(&self) -> usize {
        match self {
            AnyPrepared::SkinnedF32(body) => body.skeleton().n_joints(),
            AnyPrepared::SkinnedF16(body) => body.skeleton().n_joints(),
            AnyPrepared::SkinnedI8(body) => body.skeleton().n_joints(),
            _ => 0,
        }
    }

    /// Where a joint stands, see [`Skinned::joint_position`](super::skinned::Skinned::joint_position); `None` for forms without joints.
    pub fn joint_position(&self, at: At<'_>, joint: usize) -> Option<[f32; 3]> {
        match self {
            AnyPrepared::SkinnedF32(body) => body.joint_position(at, joint),
            AnyPrepared::SkinnedF16(body) => body.joint_position(at, joint),
            AnyPrepared::SkinnedI8(body) => body.joint_position(at, joint),
            _ => None,
        }
    }

    /// The form reads the model's file, and not its own workspace alone.
    pub fn reads_file(&self) -> bool {
        !matches!(self, AnyPrepared::Columns(_))
    }
}

/// Calls a method of the form that it is.
macro_rules! each {
    ($self:expr, $form:ident => $call:expr) => {
        match $self {
            AnyPrepared::Columns($form) => $call,
            AnyPrepared::SkinnedF32($form) => $call,
            AnyPrepared::SkinnedF16($form) => $call,
            AnyPrepared::SkinnedI8($form) => $call,
            AnyPrepared::WaveletF32($form) => $call,
            AnyPrepared::WaveletF16($form) => $call,
            AnyPrepared::WaveletI8($form) => $call,
        }
    };
}

impl Generator for AnyPrepared<'_, '_> {
    fn vertex_count(&self) -> usize {
        each!(self, form => form.vertex_count())
    }

    fn identity_dim(&self) -> usize {
        each!(self, form => Generator::identity_dim(form))
    }

    fn pose_dim(&self) -> usize {
        each!(self, form => Generator::pose_dim(form))
    }

    fn state_req(&self, derivatives: bool) -> Requirement {
        each!(self, form => form.state_req(derivatives))
    }

    fn write_state(&self, weights: Weights<'_>, derivatives: bool, state: &mut [f32]) {
        each!(self, form => form.write_state(weights, derivatives, state));
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn block_unchecked(&self, at: At<'_>, block: usize) -> Option<Block> {
        each!(self, form => form.block_unchecked(at, block))
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn linearised_block_unchecked(&self, at: At<'_>, block: usize, jacobian: &mut [[f32; NUMBERS]]) -> Option<Block> {
        each!(self, form => form.linearised_block_unchecked(at, block, jacobian))
    }

    /// Once for all callers: nine kernels at every call would be most of a program's code, and one vertex has no use for wide vectors.
    #[inline(never)]
    fn vertex_unchecked(&self, at: At<'_>, vertex: usize) -> Option<[f32; 3]> {
        each!(self, form => form.vertex_unchecked(at, vertex))
    }

    /// Once for all callers: nine kernels at every call would be most of a program's code, and one vertex has no use for wide vectors.
    #[inline(never)]
    fn linearised_vertex_unchecked(&self, at: At<'_>, vertex: usize, jacobian: &mut [[f32; 3]]) -> Option<[f32; 3]> {
        each!(self, form => form.linearised_vertex_unchecked(at, vertex, jacobian))
    }

    /// One choice for the whole range.
    #[cfg(all(feature = "inline-kernels", not(debug_assertions)))]
    #[inline(always)]
    fn evaluate_batch_at(&self, ats: &[At<'_>], vertices: Range<usize>, out: &mut [f32]) -> Result<(), Error> {
        each!(self, form => form.evaluate_batch_at(ats, vertices, out))
    }

    /// One choice for the whole range.
    #[cfg(all(feature = "inline-kernels", not(debug_assertions)))]
    #[inline(always)]
    fn linearise_at(
        &self,
        at: At<'_>,
        blocks: Range<usize>,
        values: &mut [f32],
        jacobian: &mut [f32],
    ) -> Result<(), Error> {
        each!(self, form => form.linearise_at(at, blocks, values, jacobian))
    }

    fn gradient_req(&self) -> Requirement {
        each!(self, form => form.gradient_req())
    }

    /// One choice for all vertices.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn gradient_at(
        &self,
        at: At<'_>,
        vertex_gradients: &[f32],
        gradient: &mut [f32],
        workspace: &mut [f32],
    ) -> Result<(), Error> {
        each!(self, form => form.gradient_at(at, vertex_gradients, gradient, workspace))
    }
}
