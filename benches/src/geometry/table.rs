//! Rows of measurements and how they grow with the size.

use serde_json::{Value, json};

use crate::samples::Times;

/// One program at one job and one size.
#[derive(Debug)]
pub struct Row {
    /// The subject; each has a table of its own.
    pub group: &'static str,
    /// What is done.
    pub job: String,
    /// By whom.
    pub program: String,
    /// With how many threads.
    pub threads: usize,
    /// The size: points or faces.
    pub n: usize,
    /// What the job consists of: points, faces, queries or bytes of a file.
    pub items: usize,
    /// How many of them the program did in a run; the times are scaled to all.
    pub items_timed: usize,
    /// The time of all items.
    pub times: Times,
    /// Bytes that the result occupies, or the work at its peak.
    pub bytes: Option<usize>,
}

impl Row {
    fn same_line(&self, other: &Row) -> bool {
        (self.group, &self.job, &self.program, self.threads) == (other.group, &other.job, &other.program, other.threads)
    }

    /// The row as JSON.
    pub fn json(&self) -> Value {
        json!({
            "group": self.group, "job": self.job, "program": self.program, "threads": self.threads, "n": self.n,
            "items": self.items, "items_timed": self.items_timed,
            "best_ms": self.times.best, "median_ms": self.times.median, "bytes": self.bytes,
        })
    }
}

/// The exponent `e` with which the best time grows, as `n^e`: the slope of a line through the logarithms, by least squares.
/// Nothing with a single size.
pub fn exponent(rows: &[&Row]) -> Option<f64> {
    let points: Vec<[f64; 2]> = rows.iter().map(|row| [(row.n as f64).ln(), row.times.best.ln()]).collect();
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64);
    let sum = |k: usize| points.iter().map(|p| (p[0] - mean[0]) * (p[k] - mean[k])).sum::<f64>();
    let exponent = sum(1) / sum(0);
    exponent.is_finite().then_some(exponent)
}

/// A table of each subject, as Markdown: best times in milliseconds by size; then the exponent, and for the largest size millions of
/// items a second and bytes an element.
pub fn markdown(rows: &[Row]) -> String {
    let mut text = String::new();
    let mut groups: Vec<&str> = rows.iter().map(|row| row.group).collect();
    groups.dedup();
    for group in groups {
        let rows: Vec<&Row> = rows.iter().filter(|row| row.group == group).collect();
        let mut sizes: Vec<usize> = rows.iter().map(|row| row.n).collect();
        sizes.sort_unstable();
        sizes.dedup();
        let heads: Vec<String> = sizes.iter().map(|size| format!("{size}, ms")).collect();
        text += &format!(
            "| {group} | program | threads | {} | exponent | M/s | bytes each |\n|---|---|---|{}---|---|---|\n",
            heads.join(" | "),
            "---|".repeat(sizes.len())
        );
        let mut lines: Vec<&Row> = Vec::new();
        for row in &rows {
            if !lines.iter().any(|line| line.same_line(row)) {
                lines.push(row);
            }
        }
        for line in lines {
            let of_line: Vec<&Row> = rows.iter().filter(|row| row.same_line(line)).copied().collect();
            text += &line_text(&of_line, &sizes);
        }
        text.push('\n');
    }
    text
}

fn line_text(rows: &[&Row], sizes: &[usize]) -> String {
    let cell = |size: &usize| rows.iter().find(|row| row.n == *size).map_or("-".into(), |row| short(row.times.best));
    let cells: Vec<String> = sizes.iter().map(cell).collect();
    let largest = rows[rows.len() - 1];
    format!(
        "| {} | {} | {} | {} | {} | {} | {} |\n",
        largest.job,
        largest.program,
        largest.threads,
        cells.join(" | "),
        exponent(rows).map_or("-".into(), |exponent| format!("{exponent:.2}")),
        short(largest.items as f64 / largest.times.best / 1e3),
        largest.bytes.map_or("-".into(), |bytes| format!("{:.0}", bytes as f64 / largest.n as f64)),
    )
}

/// Three digits.
pub(super) fn short(x: f64) -> String {
    let decimals = if x < 1.0 {
        3
    } else if x < 10.0 {
        2
    } else if x < 100.0 {
        1
    } else {
        0
    };
    format!("{x:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(n: usize, best: f64) -> Row {
        let times = Times { best, median: best };
        let (job, program) = ("build".into(), "habitus".into());
        Row { group: "points", job, program, threads: 1, n, items: n, items_timed: n, times, bytes: Some(12 * n) }
    }

    #[test]
    fn the_exponent_is_that_of_a_power() {
        let rows: Vec<Row> = [10, 100, 1000].map(|n| row(n, 3.0 * (n as f64).powf(1.5))).into();
        let all: Vec<&Row> = rows.iter().collect();
        assert!((exponent(&all).expect("three sizes") - 1.5).abs() < 1e-12);
        assert_eq!(exponent(&all[..1]), None);
    }

    #[test]
    fn sizes_of_a_job_stand_in_a_line() {
        let text = markdown(&[row(10, 2.0), row(1000, 200.0)]);
        assert!(text.contains("| points | program | threads | 10, ms | 1000, ms |"), "{text}");
        assert!(text.contains("| build | habitus | 1 | 2.00 | 200 | 1.00 | 0.005 | 12 |"), "{text}");
    }
}
