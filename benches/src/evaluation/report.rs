//! The measured rows as Markdown and as JSON.

use serde_json::{Value, json};

use super::Row;
use super::packaged::{Language, Packaged};
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

/// The packaged peers beside ours, in the order of the rows; nothing where none were run.
pub fn packaged_table(rows: &[Row], packaged: &Packaged) -> String {
    let mut text = String::new();
    for row in rows {
        let of = |language| packaged.fastest(row.packaged?, row.threads, language);
        let (cpp, python) = (of(Language::Cpp), of(Language::Python));
        if cpp.is_none() && python.is_none() {
            continue;
        }
        let cell = |found: Option<(&str, Times)>| match found {
            Some((name, t)) => format!("{name} {:.4} / {:.4}", t.best, t.median),
            None => "-".into(),
        };
        let ratio = |found: Option<(&str, Times)>| match found {
            Some((_, t)) => format!("{:.2} / {:.2}", row.ours.best / t.best, row.ours.median / t.median),
            None => "-".into(),
        };
        let verdict = |target: f64, t: Times| {
            let met = |ours: f64, other: f64| if ours <= target * other { "met" } else { "missed" };
            format!("{target:.2}: {} / {}", met(row.ours.best, t.best), met(row.ours.median, t.median))
        };
        let verdict = row.targets[0].zip(cpp).map_or_else(String::new, |(target, (_, t))| verdict(target, t));
        text += &format!(
            "| {} | {} | {:.4} / {:.4} | {} | {} | {verdict} | {} | {} |\n",
            row.name,
            row.threads,
            row.ours.best,
            row.ours.median,
            cell(cpp),
            ratio(cpp),
            cell(python),
            ratio(python),
        );
    }
    if !text.is_empty() {
        let title = "\n| job | threads | ours, ms: best / median | packaged, C++ | ours / it | target | packaged, Python | ours / it |\n";
        text = format!("{title}|---|---|---|---|---|---|---|---|\n{text}");
    }
    text
}

/// The same for programs.
pub fn json(rows: &[Row], program: &Program, packaged: &Packaged) -> Value {
    let times = |times: Option<Times>| times.map(|times| json!({ "best_ms": times.best, "median_ms": times.median }));
    let peer = |row: &Row, language| {
        let (name, found) = packaged.fastest(row.packaged?, row.threads, language)?;
        Some(json!({ "name": name, "best_ms": found.best, "median_ms": found.median }))
    };
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
                "packaged_cpp": peer(row, Language::Cpp),
                "packaged_python": peer(row, Language::Python),
                "target_of_peer": row.targets[0],
                "target_of_limit": row.targets[1],
            })
        })
        .collect();
    json!({ "compiler": program.compiler, "flags": FLAGS, "load": load(), "rows": rows })
}
