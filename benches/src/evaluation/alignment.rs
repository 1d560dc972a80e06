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
    let align = || -> Result<(), habitus_core::Error> {
        let moments = habitus::evaluate::moments(black_box(points), &turned)?;
        black_box(moments.similarity(true)?);
        Ok(())
    };
    bench.row(&job.peer("rigid", "Eigen umeyama", Some(0.1)).packaged("rigid_26719"), || Ok(align()?))?;
    // The sums over the points have one order: two threads align two pairs of clouds.
    let job = Job::new(format!("two of them, {} points each", points.len()), 48.0 * points.len() as f64)
        .plain("moments")
        .on(2);
    bench.row(&job, || {
        let (one, other) = rayon::join(align, align);
        Ok(one.and(other)?)
    })
}
