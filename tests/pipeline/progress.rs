//! Progress, cancellation and early finish of whole runs.

use crate::support::device;
use crate::support::shapes::{moved, sphere, union};
use glam::DVec3;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{
    CorrespondenceRequest, Error, Flow, MeasureDepth, Options, Phase, Progress, Shortage, remesh,
    remesh_with_progress,
};

const PHASES: [Phase; 8] = [
    Phase::Prepare,
    Phase::CoarseLevels,
    Phase::LastLevel,
    Phase::Polish,
    Phase::Fit,
    Phase::Outliers,
    Phase::Check,
    Phase::Measure,
];

#[test]
fn a_run_can_be_cancelled_in_every_phase_and_the_device_is_as_good_as_before() {
    let input = sample("torus").unwrap();
    let options = Options::new(600).coarsest(100).correspondence(CorrespondenceRequest::ALL);
    let whole = remesh(device(), &input, &options).unwrap();
    assert!(!whole.summary.finished_early);
    for phase in PHASES {
        let mut after = 0;
        let mut cancel = |now: Progress| {
            after += usize::from(now.phase >= phase);
            if now.phase == phase { Flow::Cancel } else { Flow::Continue }
        };
        let stopped = remesh_with_progress(device(), &input, &options, &mut cancel).err();
        assert_eq!((stopped, after), (Some(Error::Cancelled), 1), "{phase:?}");
    }
    let again = remesh_with_progress(device(), &input, &options, |_| Flow::Continue).unwrap();
    assert_eq!((again.mesh, again.correspondence), (whole.mesh, whole.correspondence));
    assert!(device().take_validation_messages().is_empty());
}

#[test]
fn a_run_that_is_to_finish_has_every_vertex_and_the_topology() {
    for name in ["torus", "box", "open-hemisphere"] {
        let input = sample(name).unwrap();
        let options = Options::new(800).coarsest(100).iterations(100_000).tolerance(0.0);
        for phase in [Phase::Prepare, Phase::CoarseLevels, Phase::LastLevel] {
            let mut finish = |now: Progress| if now.phase == phase { Flow::Finish } else { Flow::Continue };
            let done = remesh_with_progress(device(), &input, &options, &mut finish).unwrap();
            assert!(done.summary.finished_early && done.summary.iterations < 1000, "{name}, {phase:?}");
            assert_eq!(done.mesh.vertices.len(), 800);
            let (got, want) = (topology(&done.mesh), topology(&input));
            assert!(got.is_manifold(), "{name}, {phase:?}");
            assert_eq!(
                (got.euler, got.components, got.boundary_loops),
                (want.euler, want.components, want.boundary_loops),
                "{name}, {phase:?}"
            );
        }
    }
    let input = sample("torus").unwrap();
    let paper = Options::rtf(500).iterations(100_000).tolerance(0.0);
    let done = remesh_with_progress(device(), &input, &paper, |now: Progress| {
        if now.iteration >= 40 { Flow::Finish } else { Flow::Continue }
    });
    let done = done.unwrap();
    assert!(done.summary.finished_early && done.summary.iterations < 200);
    assert_eq!(done.mesh.vertices.len(), 500);
    assert!(topology(&done.mesh).is_closed_manifold());
}

#[test]
fn finishing_early_shortens_what_is_left() {
    let input = sample("torus").unwrap();
    let options = Options::new(600).polish_rounds(30);
    for phase in [Phase::Polish, Phase::Fit, Phase::Outliers] {
        let mut spots = 0;
        let mut finish = |now: Progress| {
            spots += usize::from(now.phase == Phase::Outliers);
            if now.phase >= phase { Flow::Finish } else { Flow::Continue }
        };
        let done = remesh_with_progress(device(), &input, &options, &mut finish).unwrap();
        assert!(topology(&done.mesh).is_closed_manifold() && done.mesh.vertices.len() == 600);
        assert!(spots <= 3, "{phase:?}: {spots} looks while spots are left out");
        assert!(done.summary.finished_early || phase > Phase::Polish);
    }
}

#[test]
fn the_fraction_rises_to_one() {
    for options in [Options::new(900).coarsest(100), Options::rtf(300)] {
        let mut told: Vec<Progress> = Vec::new();
        remesh_with_progress(device(), &sample("box").unwrap(), &options, |now| told.push(now)).unwrap();
        assert!(told.windows(2).all(|pair| pair[0].attempt <= pair[1].attempt));
        for pair in told.windows(2).filter(|pair| pair[0].attempt == pair[1].attempt) {
            assert!(pair[0].fraction <= pair[1].fraction, "{pair:?}");
        }
        let last = told.last().unwrap();
        assert_eq!((last.phase, last.fraction, last.to_finish), (Phase::Measure, 1.0, 0.0));
        assert!(told.iter().all(|now| now.iteration <= now.iterations && now.to_finish <= 1.0));
    }
}

/// Sites that are divided, cells that fail, and edges that are collapsed in their place.
#[test]
fn a_run_that_is_in_trouble_can_be_cancelled_at_every_look() {
    let two = union(&sample("genus3").unwrap(), &moved(&sphere(0.2, 2), |p| p + 9.0 * DVec3::X));
    for (input, vertices, shortage) in [
        (&two, 40, Shortage::BestEffort),
        (&two, 40, Shortage::AddVertices),
        (&sample("box").unwrap(), 9, Shortage::BestEffort),
    ] {
        let options = Options::new(vertices).shortage(shortage).measures(MeasureDepth::Full);
        let mut looks = 0;
        remesh_with_progress(device(), input, &options, |_| looks += 1).unwrap();
        for last in (1..looks).step_by(1 + looks / 3) {
            let mut asked = 0;
            let stopped = remesh_with_progress(device(), input, &options, |_| {
                asked += 1;
                if asked == last { Flow::Cancel } else { Flow::Continue }
            });
            // What takes long is looked at by the clock, so there may be fewer.
            assert!(asked < last || (asked == last && stopped.err() == Some(Error::Cancelled)));
        }
    }
    assert!(device().take_validation_messages().is_empty());
}

#[test]
fn a_run_in_trouble_that_is_to_finish_does_so_at_every_look() {
    let two = union(&sample("genus3").unwrap(), &moved(&sphere(0.2, 2), |p| p + 9.0 * DVec3::X));
    for (input, vertices, shortage) in [
        (&two, 60, Shortage::BestEffort),
        (&two, 60, Shortage::AddVertices),
        (&sample("box").unwrap(), 9, Shortage::BestEffort),
        (&sample("thin-plate").unwrap(), 60, Shortage::BestEffort),
    ] {
        let options = Options::new(vertices).shortage(shortage).measures(MeasureDepth::Full);
        let mut looks = 0;
        let whole = remesh_with_progress(device(), input, &options, |_| looks += 1).unwrap().summary;
        for first in (1..looks).step_by(1 + looks / 4) {
            let (mut asked, mut attempts) = (0, Vec::new());
            let done = remesh_with_progress(device(), input, &options, |now: Progress| {
                asked += 1;
                if asked < first {
                    return Flow::Continue;
                }
                attempts.push(now.attempt);
                Flow::Finish
            });
            let done = done.unwrap();
            assert!(done.mesh.vertices.len() >= vertices, "{first}");
            // No further attempt begins, but one may be on its way.
            attempts.dedup();
            assert!(attempts.len() <= 2, "{first} of {looks}: {attempts:?} of {}", whole.attempts);
        }
    }
    assert!(device().take_validation_messages().is_empty());
}
