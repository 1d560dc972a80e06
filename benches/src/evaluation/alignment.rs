//! Rigid alignment with scale.

use std::error::Error;
use std::hint::black_box;

use super::inputs::Inputs;
use super::{Bench, Job};

/// One pass over both point sets and the rotation.
///
/// # Errors
/// When a program fails.
pub fn rigid(bench: &mut Bench<'_>, inputs: &Inputs) -> Result<(), Box<dyn Error>> {
    let points = inputs.points.as_chunks::<3>().0;
    let turned: Vec<[f32; 3]> = points.iter().map(|[x, y, z]| [1.1 * y + 1.0, -1.1 * x + 2.0, 1.1 * z + 3.0]).collect();
    let job =
        Job::new(format!("rigid alignment, {} points", points.len()), 24.0 * points.len() as f64).plain("moments");
    let align = |_: &mut ()| {
        let moments = habitus::evaluate::moments(black_box(points), &turned)?;
        black_box(moments.similarity(true)?);
        Ok(())
    };
    let job = job.peer("rigid", "Eigen umeyama", Some(0.1)).packaged("rigid_26719");
    bench.row(&job, || Ok(align(&mut ())?))?;
    bench.two(&job, &mut [(), ()], align)
}
