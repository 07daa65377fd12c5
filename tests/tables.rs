//! The parts of `bench/tables` that need no device: the paper's rows, the edge-length search, tables, dates.

#[path = "../bench/tables/date.rs"]
mod date;
#[path = "../bench/tables/markdown.rs"]
mod markdown;
#[path = "../bench/tables/paper.rs"]
mod paper;
#[path = "../bench/tables/search.rs"]
mod search;

use markdown::{Table, number, ratio, significant};
use paper::{Paper, Published};
use search::{MOST_RUNS, Search, TOLERANCE};

#[test]
fn the_papers_rows_are_in_range() {
    let paper = Paper::read().unwrap();
    assert!(paper.source.contains("Tables 1 and 2") && !paper.machine.is_empty());
    let shares = |r: &Published| [r.below_30, r.above_90, r.q_min, r.q_avg];
    for row in paper.inputs.iter().chain(&paper.outputs) {
        // The counts are rounded, and all models are closed: F = 2 (V - chi).
        assert!(row.faces.abs_diff(2 * row.vertices) <= 100, "{row:?}");
        assert!(shares(row).into_iter().flatten().all(|s| (0.0..=1.0).contains(&s)), "{row:?}");
        assert!(row.q_min.zip(row.q_avg).is_none_or(|(min, avg)| min < avg), "{row:?}");
        assert!(
            row.theta_min.zip(row.theta_min_avg).is_none_or(|(min, avg)| min < avg && avg < 60.0),
            "{row:?}"
        );
        assert!(row.hausdorff.into_iter().chain(row.seconds).all(|v| v > 0.0), "{row:?}");
    }
    assert!(paper.inputs.iter().all(|row| row.hausdorff.is_none() && row.seconds.is_none()));
}

#[test]
fn the_papers_tables_are_whole() {
    let paper = Paper::read().unwrap();
    let methods = |table, model: &str| {
        let rows = paper.outputs.iter().filter(|row| (row.table, row.model.as_str()) == (table, model));
        rows.map(|row| row.method.clone()).collect::<Vec<_>>()
    };
    for model in ["moai", "botijo", "bunny", "egea"] {
        assert_eq!(methods(1, model), ["Ours"]);
    }
    for model in ["rocker-arm", "botijo", "kitten"] {
        assert_eq!(methods(2, model), ["MPS", "RVD", "RPF", "RVC", "Ours1", "Ours2"]);
    }
    for row in &paper.outputs {
        let input = paper.inputs.iter().filter(|i| (i.table, &i.model) == (row.table, &row.model));
        assert_eq!(input.count(), 1, "{row:?}");
    }
    // The counts of Fig. 7's caption over the vertices.
    let expected = [112.0, 242.0, 334.0, 392.0, 591.0, 1067.0];
    for (row, count) in paper.irregular.iter().zip(expected) {
        assert!(
            (row.share * row.vertices as f64 - count).abs() <= 1e-4 * row.vertices as f64,
            "{}",
            row.model
        );
    }
    let timed: Vec<_> = paper.fertility.iter().map(|t| (t.vertices, t.seconds)).collect();
    assert_eq!(timed, [(10_000, 18.294), (20_000, 35.434), (30_000, 62.906)]);
}

/// Searches a program that makes `count` of a length; gives the last count and the runs.
fn searched(wanted: usize, first: f64, count: impl Fn(f64) -> usize) -> (usize, usize) {
    let mut search = Search::new(wanted);
    let (mut length, mut runs) = (first, 0);
    loop {
        let found = count(length);
        runs += 1;
        match search.next(length, found) {
            Some(next) => length = next,
            None => return (found, runs),
        }
    }
}

#[test]
fn an_edge_length_is_found_in_few_runs() {
    let near = |found: usize, wanted: usize| (found as f64 / wanted as f64 - 1.0).abs() <= TOLERANCE;
    // As a plane is tiled, with edges shorter or longer than asked for.
    for factor in [0.3, 0.8, 1.0, 1.3, 4.0] {
        let (found, runs) = searched(5000, 0.02, |l| (2.0 * factor / (l * l)) as usize);
        assert!(near(found, 5000) && runs <= 3, "{factor}: {found} after {runs}");
    }
    // With small parts that keep their vertices however long edges may be, and with noise.
    let (found, runs) = searched(5000, 0.02, |l| (1500.0 + 0.9 / (l * l)) as usize);
    assert!(near(found, 5000) && runs <= MOST_RUNS, "{found} after {runs}");
    let noisy = |l: f64| (1.7 / (l * l) * (1.0 + 0.008 * (1e5 * l).sin())) as usize;
    let (found, runs) = searched(10_000, 0.011, noisy);
    assert!(near(found, 10_000) && runs <= MOST_RUNS, "{found} after {runs}");
}

#[test]
fn a_search_that_leads_nowhere_ends() {
    // A count that no length changes, one that jumps over the wanted one, and nothing at all.
    assert!(searched(1000, 0.1, |_| 500).1 <= MOST_RUNS);
    assert!(searched(1000, 0.1, |l| if l > 0.07 { 500 } else { 2000 }).1 <= MOST_RUNS);
    assert_eq!(searched(1000, 0.1, |_| 0).1, 1);
    assert!(Search::new(1000).will_do(980) && !Search::new(1000).will_do(1021));
}

#[test]
fn tables_are_written_as_markdown() {
    let mut table = Table::new(["model", "θmin", "note"]);
    table.push(vec!["kitten".into(), "31.15".into(), "a | b\nc".into()]);
    table.push(vec!["bunny".into(), number(None, 2)]);
    let expected = "| model  |  θmin | note     |\n\
                    |--------|------:|----------|\n\
                    | kitten | 31.15 | a \\| b c |\n\
                    | bunny  |     – |          |\n";
    assert_eq!(table.to_markdown(), expected);
}

#[test]
fn numbers_have_the_digits_that_matter() {
    let texts = [123_456.0, 13.334, 0.469, 0.012_34, 0.0].map(|v| significant(Some(v)));
    assert_eq!(texts, ["123456", "13.3", "0.469", "0.0123", "0"]);
    assert_eq!(number(Some(f64::NAN), 2), "–");
    assert_eq!(ratio(Some(3.0), Some(2.0)), "×1.50");
    // Nothing is a multiple of 0 or of what is not known.
    assert_eq!(
        [ratio(Some(3.0), Some(0.0)), ratio(Some(3.0), None), ratio(None, Some(2.0))],
        ["–", "–", "–"]
    );
}

#[test]
fn seconds_become_dates() {
    assert_eq!(date::utc(0), "1970-01-01 00:00 UTC");
    assert_eq!(date::utc(951_782_399), "2000-02-28 23:59 UTC");
    assert_eq!(date::utc(951_782_400), "2000-02-29 00:00 UTC");
    assert_eq!(date::utc(1_798_761_599), "2026-12-31 23:59 UTC");
}
