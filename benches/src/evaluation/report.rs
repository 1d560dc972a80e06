//! The measured rows as Markdown and as JSON.

use serde_json::{Value, json};

use super::Row;
use crate::peer::{FLAGS, Program};
use crate::samples::{Times, load};

/// Best and median in milliseconds, ratios of both, and the verdict on the row's targets.
pub fn table(rows: &[Row], program: &Program, peers: &str) -> String {
    let mut text = format!("C++: {} {};{peers}; load {}\n\n", program.compiler, FLAGS.join(" "), load());
    text += "| job | threads | ours, ms: best / median | limit, ms | ours / limit | plain loop over our layout, ms | peer, ms | ours / peer | targets |\n";
    text += "|---|---|---|---|---|---|---|---|---|\n";
    let pair = |times: Option<Times>| times.map_or("-".into(), |t| format!("{:.4} / {:.4}", t.best, t.median));
    for row in rows {
        let ratio = |other: Times| format!("{:.2} / {:.2}", row.ours.best / other.best, row.ours.median / other.median);
        text += &format!(
            "| {} | {} | {} | {} | {} | {} | {} {} | {} | {} |\n",
            row.name,
            row.threads,
            pair(Some(row.ours)),
            pair(Some(row.limit)),
            ratio(row.limit),
            pair(row.plain),
            row.peer_name,
            pair(row.peer),
            row.peer.map_or("-".into(), ratio),
            verdicts(row).join("; "),
        );
    }
    text
}

/// Each target of a row, and whether it is met by best and by median.
fn verdicts(row: &Row) -> Vec<String> {
    let others = [("peer", row.peer), ("limit", Some(row.limit))];
    let of = |((name, other), target): ((&str, Option<Times>), Option<f64>)| {
        let (other, target) = (other?, target?);
        let met = |ours: f64, other: f64| if ours <= target * other { "met" } else { "missed" };
        let (best, median) = (met(row.ours.best, other.best), met(row.ours.median, other.median));
        Some(format!("{target:.2} x {name}: {best} / {median}"))
    };
    others.into_iter().zip(row.targets).filter_map(of).collect()
}

/// The same for programs.
pub fn json(rows: &[Row], program: &Program) -> Value {
    let times = |times: Option<Times>| times.map(|times| json!({ "best_ms": times.best, "median_ms": times.median }));
    let rows: Vec<_> = rows
        .iter()
        .map(|row| {
            json!({
                "job": row.name,
                "threads": row.threads,
                "ours": times(Some(row.ours)),
                "limit": times(Some(row.limit)),
                "plain_cpp_own_layout": times(row.plain),
                "peer": times(row.peer),
                "peer_name": row.peer_name,
                "target_of_peer": row.targets[0],
                "target_of_limit": row.targets[1],
            })
        })
        .collect();
    json!({ "compiler": program.compiler, "flags": FLAGS, "load": load(), "rows": rows })
}
