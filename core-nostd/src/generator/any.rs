//! A generator of whatever kind and storage a model file has: for hosts that open files they have not made.
//!
//! It links the kernels of every kind and storage. A program that knows its model takes [`Model::bilinear`](crate::format::Model::bilinear) and the like,
//! and links no more than that.
//!
//! The kernels of every kind at every call are too much code and take too long to compile where nothing is gained by them: they are inlined only with the
//! feature `inline-kernels`, which hosts that choose the width of their vectors at run time turn on (`habitus-dispatch`), and in builds without debug
//! assertions. The bits are the same.

use core::ops::Range;

use super::bilinear::Bilinear;
use super::linear::Linear;
use super::skinned::{Blend, Skinned};
use super::wavelet::{Multiscale, Stored};
use super::{At, Block, Generator, NUMBERS, Weights};
use crate::Error;
use crate::format::{Kind, SectionId};
use crate::quantise::{F16, F32, I8};
use crate::skeleton::{JointMode, Skeleton};
use crate::workspace::Requirement;

/// The generator of an opened model, see [`Model::generator`](crate::format::Model::generator). The bits are those of the kind's own type.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
#[non_exhaustive]
pub enum AnyGenerator<'a> {
    BilinearF32(Bilinear<'a, F32<'a>>),
    BilinearF16(Bilinear<'a, F16<'a>>),
    BilinearI8(Bilinear<'a, I8<'a>>),
    LinearF32(Linear<'a, F32<'a>>),
    LinearF16(Linear<'a, F16<'a>>),
    LinearI8(Linear<'a, I8<'a>>),
    SkinnedF32(Skinned<'a, Linear<'a, F32<'a>>>),
    SkinnedF16(Skinned<'a, Linear<'a, F16<'a>>>),
    SkinnedI8(Skinned<'a, Linear<'a, I8<'a>>>),
    WaveletF32(Multiscale<Stored<'a, F32<'a>>>),
    WaveletF16(Multiscale<Stored<'a, F16<'a>>>),
    WaveletI8(Multiscale<Stored<'a, I8<'a>>>),
}

/// Calls a method of the generator that it is.
macro_rules! each {
    ($self:expr, $generator:ident => $call:expr) => {
        match $self {
            AnyGenerator::BilinearF32($generator) => $call,
            AnyGenerator::BilinearF16($generator) => $call,
            AnyGenerator::BilinearI8($generator) => $call,
            AnyGenerator::LinearF32($generator) => $call,
            AnyGenerator::LinearF16($generator) => $call,
            AnyGenerator::LinearI8($generator) => $call,
            AnyGenerator::SkinnedF32($generator) => $call,
            AnyGenerator::SkinnedF16($generator) => $call,
            AnyGenerator::SkinnedI8($generator) => $call,
            AnyGenerator::WaveletF32($generator) => $call,
            AnyGenerator::WaveletF16($generator) => $call,
            AnyGenerator::WaveletI8($generator) => $call,
        }
    };
}

/// Calls a method of the body that it is.
macro_rules! skinned {
    ($self:expr, $body:ident => $call:expr, $other:expr) => {
        match $self {
            AnyGenerator::SkinnedF32($body) => $call,
            AnyGenerator::SkinnedF16($body) => $call,
            AnyGenerator::SkinnedI8($body) => $call,
            _ => $other,
        }
    };
}

impl<'a> AnyGenerator<'a> {
    /// The skeleton of a body; `None` for other kinds.
    pub fn skeleton(&self) -> Option<&Skeleton<'a>> {
        skinned!(self, body => Some(body.skeleton()), None)
    }

    /// How a body blends motions; `None` for other kinds.
    pub fn blend(&self) -> Option<Blend> {
        skinned!(self, body => Some(body.blend()), None)
    }

    /// Whether the joints of a body follow the identity; `None` for other kinds.
    pub fn joints(&self) -> Option<JointMode> {
        skinned!(self, body => Some(body.joints()), None)
    }

    /// Blends motions in another way from now on, see [`Skinned::with_blend`].
    ///
    /// Errors: `WrongKind` for other kinds than bodies.
    pub fn set_blend(&mut self, blend: Blend) -> Result<(), Error> {
        skinned!(self, body => *body = body.with_blend(blend), return Err(self.is_no_body()));
        Ok(())
    }

    /// Lets joints follow the identity or stay from now on, see [`Skinned::with_joints`].
    ///
    /// Errors: `WrongKind` for other kinds than bodies; `Unsupported` when the file does not know how joints follow the identity.
    pub fn set_joints(&mut self, joints: JointMode) -> Result<(), Error> {
        let regressed = self.skeleton().is_none_or(Skeleton::is_regressed);
        if joints == JointMode::Regressed && !regressed {
            return Err(Error::Unsupported { section: SectionId::JointBasis as u32 });
        }
        skinned!(self, body => *body = body.with_joints(joints), return Err(self.is_no_body()));
        Ok(())
    }

    /// Where a joint of a body stands, see [`Skinned::joint_position`]; `None` for other kinds and other joints.
    pub fn joint_position(&self, at: At<'_>, joint: usize) -> Option<[f32; 3]> {
        skinned!(self, body => body.joint_position(at, joint), None)
    }

    /// The kind that it is.
    pub fn kind(&self) -> Kind {
        match self {
            AnyGenerator::BilinearF32(_) | AnyGenerator::BilinearF16(_) | AnyGenerator::BilinearI8(_) => Kind::Bilinear,
            AnyGenerator::LinearF32(_) | AnyGenerator::LinearF16(_) | AnyGenerator::LinearI8(_) => Kind::Linear,
            AnyGenerator::SkinnedF32(_) | AnyGenerator::SkinnedF16(_) | AnyGenerator::SkinnedI8(_) => Kind::Skinned,
            AnyGenerator::WaveletF32(_) | AnyGenerator::WaveletF16(_) | AnyGenerator::WaveletI8(_) => Kind::Wavelet,
        }
    }

    /// [`Multiscale::with_levels`] of a wavelet model.
    ///
    /// Errors: as there; `WrongKind` for another model.
    pub fn with_levels(self, detail: usize, resolution: usize) -> Result<Self, Error> {
        Ok(match self {
            AnyGenerator::WaveletF32(of) => AnyGenerator::WaveletF32(of.with_levels(detail, resolution)?),
            AnyGenerator::WaveletF16(of) => AnyGenerator::WaveletF16(of.with_levels(detail, resolution)?),
            AnyGenerator::WaveletI8(of) => AnyGenerator::WaveletI8(of.with_levels(detail, resolution)?),
            other => return Err(other.no_wavelet()),
        })
    }

    /// [`Multiscale::with_window`] of a wavelet model.
    ///
    /// Errors: as there; `WrongKind` for another model.
    pub fn with_window(self, columns: Range<usize>, rows: Range<usize>) -> Result<Self, Error> {
        Ok(match self {
            AnyGenerator::WaveletF32(of) => AnyGenerator::WaveletF32(of.with_window(columns, rows)?),
            AnyGenerator::WaveletF16(of) => AnyGenerator::WaveletF16(of.with_window(columns, rows)?),
            AnyGenerator::WaveletI8(of) => AnyGenerator::WaveletI8(of.with_window(columns, rows)?),
            other => return Err(other.no_wavelet()),
        })
    }

    fn no_wavelet(&self) -> Error {
        Error::WrongKind { expected: Kind::Wavelet as u32, found: self.kind() as u32 }
    }

    fn is_no_body(&self) -> Error {
        Error::WrongKind { expected: Kind::Skinned as u32, found: self.kind() as u32 }
    }
}

impl Generator for AnyGenerator<'_> {
    fn vertex_count(&self) -> usize {
        each!(self, generator => generator.vertex_count())
    }

    fn identity_dim(&self) -> usize {
        each!(self, generator => Generator::identity_dim(generator))
    }

    fn pose_dim(&self) -> usize {
        each!(self, generator => Generator::pose_dim(generator))
    }

    fn state_req(&self, derivatives: bool) -> Requirement {
        each!(self, generator => generator.state_req(derivatives))
    }

    fn write_state(&self, weights: Weights<'_>, derivatives: bool, state: &mut [f32]) {
        each!(self, generator => generator.write_state(weights, derivatives, state));
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn block_unchecked(&self, at: At<'_>, block: usize) -> Option<Block> {
        each!(self, generator => generator.block_unchecked(at, block))
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn linearised_block_unchecked(&self, at: At<'_>, block: usize, jacobian: &mut [[f32; NUMBERS]]) -> Option<Block> {
        each!(self, generator => generator.linearised_block_unchecked(at, block, jacobian))
    }

    /// Once for all callers: nine kernels at every call would be most of a program's code, and one vertex has no use for wide vectors.
    #[inline(never)]
    fn vertex_unchecked(&self, at: At<'_>, vertex: usize) -> Option<[f32; 3]> {
        each!(self, generator => generator.vertex_unchecked(at, vertex))
    }

    /// Once for all callers: nine kernels at every call would be most of a program's code, and one vertex has no use for wide vectors.
    #[inline(never)]
    fn linearised_vertex_unchecked(&self, at: At<'_>, vertex: usize, jacobian: &mut [[f32; 3]]) -> Option<[f32; 3]> {
        each!(self, generator => generator.linearised_vertex_unchecked(at, vertex, jacobian))
    }

    /// One choice for the whole range.
    #[cfg(all(feature = "inline-kernels", not(debug_assertions)))]
    #[inline(always)]
    fn evaluate_batch_at(&self, ats: &[At<'_>], vertices: Range<usize>, out: &mut [f32]) -> Result<(), Error> {
        each!(self, generator => generator.evaluate_batch_at(ats, vertices, out))
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
        each!(self, generator => generator.linearise_at(at, blocks, values, jacobian))
    }

    fn gradient_req(&self) -> Requirement {
        each!(self, generator => generator.gradient_req())
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
        each!(self, generator => generator.gradient_at(at, vertex_gradients, gradient, workspace))
    }
}
