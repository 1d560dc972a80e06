//! What a fit is made to: a model, or a prepared form of it, as one generator.
//!
//! One type for both, with kernels that are called and choose the width of their vectors themselves: the solver is 40 KB of code for every width, and
//! inside it the kernels of every kind and storage would be half a megabyte. The choice costs some nanoseconds a block of vertices.

use habitus_core::format::{Mode, Model};
use habitus_core::generator::any_prepared::AnyPrepared;
use habitus_core::generator::{At, Block, Generator, NUMBERS, Weights};
use habitus_core::workspace::Requirement;
use habitus_dispatch::Blockwise;

use crate::code::{Refusal, length};
use crate::memory::Arguments;
use crate::model::{Opened, hab_model, opened};
use crate::prepared::{formed, hab_prepared};

/// A model and perhaps a form of all its blocks.
pub(crate) struct Shape<'a> {
    opened: &'a Opened,
    form: Option<&'a AnyPrepared<'static, 'static>>,
}

impl<'a> Shape<'a> {
    /// Of the arguments 1 and 2.
    ///
    /// # Safety
    /// As [`opened`] and [`formed`].
    pub(crate) unsafe fn of(
        arguments: &mut Arguments,
        model: *const hab_model,
        prepared: *const hab_prepared,
    ) -> Result<Self, Refusal> {
        if !prepared.is_null() {
            // Known before a refusal of the model can be handed out.
            arguments.object(2, prepared);
        }
        // SAFETY: the caller's promise.
        let opened = unsafe { opened(arguments, 1, model)? };
        if prepared.is_null() {
            return Ok(Shape { opened, form: None });
        }
        // SAFETY: the caller's promise.
        let form = &unsafe { formed(arguments, 2, prepared)? }.form;
        // A form of some of the blocks, or of another model, has other vertices.
        length(2, opened.generator.vertex_count(), form.vertex_count())?;
        let free_dim = match form.free() {
            Mode::Identity => opened.generator.identity_dim(),
            Mode::Pose => opened.generator.pose_dim(),
        };
        length(2, free_dim, form.dim())?;
        Ok(Shape { opened, form: Some(form) })
    }

    pub(crate) fn opened(&self) -> &'a Opened {
        self.opened
    }

    pub(crate) fn model(&self) -> &'a Model<'static> {
        &self.opened.model
    }
}

/// Calls a method of the form, or of the whole model.
macro_rules! either {
    ($self:ident, $generator:ident => $call:expr) => {
        match $self.form {
            Some($generator) => $call,
            None => {
                let $generator = &$self.opened.generator;
                $call
            }
        }
    };
}

impl Generator for Shape<'_> {
    fn vertex_count(&self) -> usize {
        either!(self, generator => generator.vertex_count())
    }

    fn identity_dim(&self) -> usize {
        either!(self, generator => generator.identity_dim())
    }

    fn pose_dim(&self) -> usize {
        either!(self, generator => generator.pose_dim())
    }

    fn state_req(&self, derivatives: bool) -> Requirement {
        either!(self, generator => generator.state_req(derivatives))
    }

    fn write_state(&self, weights: Weights<'_>, derivatives: bool, state: &mut [f32]) {
        either!(self, generator => generator.write_state(weights, derivatives, state));
    }

    #[inline(never)]
    fn block_unchecked(&self, at: At<'_>, block: usize) -> Option<Block> {
        either!(self, generator => Blockwise(generator).block_unchecked(at, block))
    }

    #[inline(never)]
    fn linearised_block_unchecked(&self, at: At<'_>, block: usize, jacobian: &mut [[f32; NUMBERS]]) -> Option<Block> {
        either!(self, generator => Blockwise(generator).linearised_block_unchecked(at, block, jacobian))
    }

    #[inline(always)]
    fn vertex_unchecked(&self, at: At<'_>, vertex: usize) -> Option<[f32; 3]> {
        either!(self, generator => generator.vertex_unchecked(at, vertex))
    }

    #[inline(always)]
    fn linearised_vertex_unchecked(&self, at: At<'_>, vertex: usize, jacobian: &mut [[f32; 3]]) -> Option<[f32; 3]> {
        either!(self, generator => generator.linearised_vertex_unchecked(at, vertex, jacobian))
    }
}
