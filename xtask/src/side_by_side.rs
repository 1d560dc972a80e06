//! The same work on many things, several at a time.

use crate::process::Result;
use std::sync::Mutex;

/// As many as there are processors.
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, |jobs| jobs.get())
}

/// Does the work on every item, at most `jobs` at a time, begun in their order; the results in the order of the items.
pub fn each<T: Sync, R: Send>(items: &[T], jobs: usize, work: impl Fn(&T) -> R + Sync) -> Result<Vec<R>> {
    let queue = Mutex::new(items.iter().enumerate());
    let results = Mutex::new(Vec::new());
    let next = || queue.lock().ok()?.next();
    std::thread::scope(|scope| {
        for _ in 0..jobs.min(items.len()) {
            scope.spawn(|| {
                while let Some((position, item)) = next() {
                    let result = work(item);
                    if let Ok(mut results) = results.lock() {
                        results.push((position, result));
                    }
                }
            });
        }
    });
    let mut results = results.into_inner().map_err(|_| String::from("a thread panicked"))?;
    results.sort_by_key(|(position, _)| *position);
    if results.len() != items.len() {
        return Err(String::from("a thread panicked").into());
    }
    Ok(results.into_iter().map(|(_, result)| result).collect())
}

#[cfg(test)]
mod tests {
    use super::each;

    #[test]
    fn results_keep_the_order_of_the_items() {
        for jobs in [1, 2, 7] {
            let doubled = each(&[1, 2, 3, 4, 5], jobs, |item| 2 * item).expect("nothing panics");
            assert_eq!(doubled, [2, 4, 6, 8, 10]);
        }
        assert!(each(&[], 2, |item: &u8| *item).expect("nothing to do").is_empty());
    }
}
