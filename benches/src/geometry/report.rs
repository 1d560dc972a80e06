//! The section on geometry of `RESULTS.md`: command, machine, ratios to others beside their limits, then all tables.

use super::table::{Row, exponent, markdown, short};

/// A claim of the table of performance: our time over that of another program in the same run, at about the size `n`.
struct Claim {
    group: &'static str,
    job: &'static str,
    ours: &'static str,
    other: &'static str,
    n: usize,
    limit: f64,
}

const ONE_BY_ONE: &str = "habitus, one by one";

/// Rows of the table of performance that name another program: 400 / 643 and 4500 / 5968 ms for closest points.
const CLAIMS: [Claim; 7] = [
    Claim { group: "triangles", job: "closest of 100k near", ours: "habitus", other: "CGAL", n: 398_000, limit: 0.62 },
    Claim { group: "triangles", job: "closest of 100k near", ours: ONE_BY_ONE, other: "CGAL", n: 398_000, limit: 0.62 },
    Claim { group: "triangles", job: "closest of 100k far", ours: "habitus", other: "CGAL", n: 398_000, limit: 0.75 },
    Claim { group: "triangles", job: "closest of 100k far", ours: ONE_BY_ONE, other: "CGAL", n: 398_000, limit: 0.75 },
    Claim { group: "points", job: "build", ours: "habitus", other: "nanoflann", n: 200_000, limit: 1.0 },
    Claim { group: "points", job: "nearest of 100k near", ours: "habitus", other: "kiddo", n: 200_000, limit: 1.0 },
    Claim { group: "points", job: "nearest of 100k far", ours: "habitus", other: "nanoflann", n: 200_000, limit: 1.0 },
];

/// A throughput that is asked for, millions of items a second at the largest size.
struct Floor {
    group: &'static str,
    job: &'static str,
    least: f64,
    unit: &'static str,
}

const FLOORS: [Floor; 5] = [
    Floor { group: "cleaning", job: "of single faces", least: 1.0, unit: "M faces/s" },
    Floor { group: "files", job: "PLY, text: read", least: 150.0, unit: "MB/s" },
    Floor { group: "files", job: "OBJ: read", least: 150.0, unit: "MB/s" },
    Floor { group: "files", job: "OFF: read", least: 150.0, unit: "MB/s" },
    Floor { group: "decimation", job: "to a tenth", least: 0.2, unit: "M faces/s" },
];

/// The circumstances of a run.
pub struct Circumstances {
    /// The arguments of the program.
    pub arguments: String,
    /// Name and version of the C++ compiler.
    pub compiler: Option<String>,
    /// Load average before and after.
    pub load: [String; 2],
}

/// The section as Markdown.
pub fn section(rows: &[Row], circumstances: &Circumstances) -> String {
    let Circumstances { arguments, compiler, load: [before, after] } = circumstances;
    format!(
        "## Geometry\n\n    cargo run --release -p habitus-benches --bin geometry -- {arguments}\n\n\
         - Machine: {}. C++: {}, `-O3 -march=native`.\n\
         - Load average {before} before, {after} after; well above the number of our threads, times are too long and only ratios, \
         whose programs took turns, mean something.\n\
         - Times are the best of the turns. Exponents are fitted to all sizes. Bytes: what is kept (search), the peak (files, cleaning), \
         by element.\n\n{}\n{}\n{}\n{}",
        machine(),
        compiler.as_deref().unwrap_or("none"),
        claims(rows),
        floors(rows),
        vertices(rows),
        markdown(rows),
    )
}

fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let value = |name: &str| {
        let line = text.lines().find(|line| line.starts_with(name))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    };
    let [name, family, model] =
        ["model name", "cpu family", "model\t"].map(|name| value(name).unwrap_or("unknown".into()));
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    format!("{name} (family {family}, model {model}), {cores} cores")
}

/// The row of one thread whose size is nearest to the one that is wanted, within a tenth.
fn row<'a>(rows: &'a [Row], group: &str, job: &str, program: &str, n: usize) -> Option<&'a Row> {
    let is_it = |row: &&Row| {
        let named = row.program == program || (!program.starts_with("habitus") && row.program.starts_with(program));
        (row.group, row.job.as_str(), row.threads) == (group, job, 1) && named && row.n.abs_diff(n) * 10 <= n
    };
    rows.iter().filter(is_it).min_by_key(|row| row.n.abs_diff(n))
}

fn verdict(is_met: bool) -> &'static str {
    if is_met { "met" } else { "missed" }
}

fn claims(rows: &[Row]) -> String {
    let mut text =
        "| one thread | n | ours, ms | other, ms | ours / other | limit | verdict |\n|---|---|---|---|---|---|---|\n"
            .to_owned();
    for Claim { group, job, ours, other, n, limit } in CLAIMS {
        let (Some(one), Some(two)) = (row(rows, group, job, ours, n), row(rows, group, job, other, n)) else {
            text += &format!("| {group}: {job}, {ours} : {other} | {n} | - | - | - | {limit} | not measured |\n");
            continue;
        };
        let ratio = one.times.best / two.times.best;
        text += &format!(
            "| {group}: {job}, {ours} : {} | {} | {} | {} | {ratio:.2} | {limit} | {} |\n",
            two.program,
            one.n,
            short(one.times.best),
            short(two.times.best),
            verdict(ratio <= limit),
        );
    }
    text
}

fn floors(rows: &[Row]) -> String {
    let mut text =
        "| throughput, one thread | n | seen | at least | exponent | verdict |\n|---|---|---|---|---|---|\n".to_owned();
    for Floor { group, job, least, unit } in FLOORS {
        let of_line = |row: &&Row| (row.group, row.job.as_str(), row.program.as_str()) == (group, job, "habitus");
        let line: Vec<&Row> = rows.iter().filter(of_line).collect();
        let Some(largest) = line.last() else {
            text += &format!("| {group}: {job} | - | - | {least} {unit} | - | not measured |\n");
            continue;
        };
        let seen = largest.items as f64 / largest.times.best / 1e3;
        text += &format!(
            "| {group}: {job} | {} | {} {unit} | {least} | {} | {} |\n",
            largest.n,
            short(seen),
            exponent(&line).map_or("-".into(), |exponent| format!("{exponent:.2}")),
            verdict(seen >= least),
        );
    }
    text
}

/// Files by vertices, for the largest size: the surface has half as many as faces, and 2.
fn vertices(rows: &[Row]) -> String {
    let files = || rows.iter().filter(|row| row.group == "files" && row.program == "habitus");
    let Some(n) = files().map(|row| row.n).max() else { return String::new() };
    let mut text = format!("| file of {n} faces | MB/s | M vertices/s |\n|---|---|---|\n");
    for row in files().filter(|row| row.n == n) {
        let per_ms = |count: f64| short(count / row.times.best / 1e3);
        text += &format!("| {} | {} | {} |\n", row.job, per_ms(row.items as f64), per_ms((n / 2 + 2) as f64));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::Times;

    fn row(program: &str, best: f64) -> Row {
        let (job, program, times) = ("closest of 100k near".into(), program.into(), Times { best, median: best });
        Row { group: "triangles", job, program, threads: 1, n: 397_620, items: 1, items_timed: 1, times, bytes: None }
    }

    #[test]
    fn a_claim_is_met_missed_or_not_measured() {
        let met = claims(&[row("habitus", 62.0), row("CGAL 5.5.1", 100.0)]);
        assert!(met.contains("near, habitus : CGAL 5.5.1 | 397620 | 62.0 | 100 | 0.62 | 0.62 | met |"), "{met}");
        let missed = claims(&[row("habitus", 63.0), row("CGAL 5.5.1", 100.0)]);
        assert!(missed.contains("| 0.63 | 0.62 | missed |"), "{missed}");
        assert_eq!(claims(&[row("habitus", 1.0)]).matches("not measured").count(), CLAIMS.len());
    }
}
