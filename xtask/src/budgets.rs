//! Budgets: what a program may cost at most (tests/budgets.json). Growing needs an edit there, and a reason.

use crate::figures::{COUNT, Figures};
use crate::process::project;
use serde_json::Value;

/// Relative to the project.
const PATH: &str = "tests/budgets.json";

/// The budgets: profile, program, figure.
pub struct Budgets(Value);

impl Budgets {
    /// Reads the file of the repository.
    pub fn read() -> Result<Budgets, String> {
        let text = std::fs::read_to_string(project().join(PATH)).map_err(|error| format!("{PATH}: {error}"))?;
        Ok(Budgets(serde_json::from_str(&text).map_err(|error| format!("{PATH}: {error}"))?))
    }

    /// A sentence for every figure (`code`, and the stack that a program measured itself, in bytes; the instructions that it counted) that exceeds its
    /// budget or has none.
    pub fn exceeded(&self, profile: &str, program: &str, figures: &Figures) -> Vec<String> {
        let is_limited = |name: &str| name == "code" || name.starts_with("stack") || name.starts_with(COUNT);
        let limited = figures.iter().filter(|(name, _)| is_limited(name));
        limited
            .filter_map(|(name, &found)| match self.0[profile][program][name].as_u64() {
                Some(limit) if found <= limit => None,
                Some(limit) => Some(format!("{program} ({profile}): {name} is {found}, its budget {limit}")),
                None => Some(format!("{program} ({profile}): {name} is {found} and has no budget in {PATH}")),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Budgets;
    use crate::figures::Figures;

    #[test]
    fn more_than_the_budget_or_no_budget_is_reported_and_less_is_not() {
        let budgets = Budgets(serde_json::json!({ "release": { "fit": { "stack": 100, "code": 5000 } } }));
        let figures =
            |stack, code| Figures::from([("stack".into(), stack), ("code".into(), code), ("checked".into(), 9)]);
        let counted = Figures::from([("count_linear_f32_value".into(), 70)]);
        assert_eq!(budgets.exceeded("release", "counts", &counted).len(), 1);
        assert!(budgets.exceeded("release", "fit", &figures(100, 5000)).is_empty());
        assert_eq!(budgets.exceeded("release", "fit", &figures(101, 5000)).len(), 1);
        assert_eq!(budgets.exceeded("release", "open", &figures(1, 1)).len(), 2);
    }
}
