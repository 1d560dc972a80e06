//! The core gives the bits of the golden vectors, called directly; with wider vectors: tests/tests/dispatched.rs.

use habitus_golden::{CaseResult, Memory, REQUIREMENT, Summary, VECTORS, Vectors, run};

fn with_memory<T>(work: impl FnOnce(&mut Memory<'_>) -> T) -> T {
    work(&mut Memory {
        floats: &mut vec![0.0; REQUIREMENT.floats],
        doubles: &mut vec![0.0; REQUIREMENT.doubles],
        bytes: &mut vec![0; REQUIREMENT.bytes],
        indices: &mut vec![0; REQUIREMENT.indices],
    })
}

fn summary_of(vectors: &Vectors<'_>, report: &mut dyn FnMut(&CaseResult<'_>)) -> Summary {
    with_memory(|memory| run(vectors, memory, report))
}

/// All vectors, no difference, and as many as there should be: a runner that finds no vectors is no proof.
#[test]
fn equal_bits() {
    let summary = summary_of(&VECTORS, &mut |result| {
        if !result.is_equal() {
            eprintln!("{result:?}");
        }
    });
    println!("{summary:?}");
    assert_eq!((summary.failed, summary.differing_bits), (0, 0));
    assert!(summary.cases >= 630 && summary.numbers >= 51_000, "{summary:?}");
}

/// Negative control: the last bit of the last number of a case, changed in the vectors, is one differing bit or a refusal of the case.
#[test]
fn one_changed_bit_is_reported() {
    for (position, (file, text)) in VECTORS.files.into_iter().enumerate() {
        let starts: Vec<usize> = text.match_indices("\ncase ").map(|(at, _)| at).collect();
        let mut tried = 0;
        for (k, &start) in starts.iter().enumerate() {
            let end = starts.get(k + 1).copied().unwrap_or(text.len());
            let at = start + text[start..end].trim_end().len() - 1;
            let digit = text[at..=at].chars().next().and_then(|digit| digit.to_digit(16)).expect("a digit");
            let mut changed = text.to_owned();
            changed.replace_range(at..=at, &format!("{:x}", digit ^ 1));
            let mut vectors = Vectors { files: [("", ""); 6], ..VECTORS };
            vectors.files[position] = (file, &changed[start..end]);
            let summary = summary_of(&vectors, &mut |_| ());
            assert_eq!((summary.cases, summary.failed), (1, 1), "{file}: {}", &text[start..start + 60]);
            tried += 1;
        }
        assert!(tried > 20, "{file}: {tried} cases");
    }
}

#[test]
fn a_damaged_model_and_missing_memory_are_reported() {
    let models = VECTORS.models.replace("case model linear_17\n", "case model linear_17_gone\n");
    let vectors = Vectors { models: &models, ..VECTORS };
    assert!(summary_of(&vectors, &mut |_| ()).failed > 5);
    let mut none = Memory { floats: &mut [], doubles: &mut [], bytes: &mut [], indices: &mut [] };
    let summary = run(&VECTORS, &mut none, &mut |_| ());
    assert!(summary.failed > summary.cases / 2, "{summary:?}");
}
