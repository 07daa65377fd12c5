//! Tests of the relaxation between curves, before anything is connected.

use super::Origin;
use super::level::{Level, LevelOptions, Moves};
use super::levels::{Extent, levels};
use super::shared::CoarseToFine;
use super::surface_model::SurfaceModel;
use crate::gpu::{Device, DeviceOptions};
use crate::mesh::NONE;
use crate::mesh::features::FeatureOptions;
use crate::mesh::samples::sample;
use crate::mesh::sizing::SizeField;
use crate::mesh::topology::topology;
use crate::mesh::unit_frame::UnitFrame;
use crate::pipeline::intersections::InputIntersections;
use crate::pipeline::plan::Plan;
use crate::pipeline::run_context::RunContext;
use crate::pipeline::user_curves::UserCurves;
use crate::progress::{ProgressReporter, ProgressToken};
use crate::sites::surface::Surface;
use crate::{Flow, Options, Sizing, TriMesh};

/// Relaxes `count` sites on the mesh, with the checks that hold for all; returns the steps in spacings.
fn relaxed(mesh: &TriMesh, count: usize) -> Vec<f64> {
    let device = Device::open(&DeviceOptions { validation: true, ..DeviceOptions::from_env() }).unwrap();
    let frame = UnitFrame::of(mesh).unwrap();
    let surface = Surface::new(mesh, &frame);
    let spacing = crate::mesh::spacing(surface.area(), count);
    let sized = |_: Option<&_>, _: &_| Ok(SizeField::default());
    let progress = ProgressToken::default();
    let model =
        SurfaceModel::with(&device, &surface, &FeatureOptions::new(spacing), (None, &sized), &progress)
            .unwrap();
    let (input, options) = (topology(mesh), Options::new(count));
    let curves = model.curves.as_ref().unwrap();
    let extent = Extent { area: surface.area(), euler: input.euler, curves: Some(curves) };
    let last = *levels(&extent, count, count).unwrap().last().unwrap();
    let plan = Plan {
        vertices: count,
        coarsest: count,
        sizing: Sizing::Uniform,
        bends: None,
        min_edge: None,
        curves: UserCurves::default(),
        pinned: Default::default(),
        refined: Default::default(),
    };
    let context = RunContext {
        device: &device,
        mesh,
        frame: &frame,
        surface: &surface,
        input: &input,
        input_intersections: &InputIntersections::default(),
        options: &options,
        plan: &plan,
        deviation: None,
    };
    let run = CoarseToFine { context, vertices: count, seed: options.seed, model: &model };
    let (start, on_curves) = run.start(Origin::Scattered, &last);
    let pins = on_curves.unwrap().pins;
    assert_eq!(start.sites.len(), count);
    let options = LevelOptions {
        spacing: last.spacing,
        has_sizes: false,
        iterations: 40,
        moves: Moves::SCATTERED,
        is_last: true,
    };
    let level = Level::new(&device, &start, &options).unwrap();
    let mut callback = |_| Flow::Continue;
    let mut progress = ProgressReporter::new(&mut callback);
    let result = level.relax(&device, &start, &model.on_device(), 0.0, &mut progress).unwrap();
    let begin = start.pinned.unwrap().sites;
    for (i, begin) in begin.iter().enumerate() {
        if pins[i] != NONE {
            assert_eq!(result.sites.positions[i].as_vec3(), begin.truncate(), "curve site {i} has moved");
            continue;
        }
        let patch = |t: u32| curves.patches[t as usize];
        assert_eq!(
            patch(start.sites.triangles[i]),
            patch(result.sites.triangles[i]),
            "site {i} left its patch"
        );
        let twin = |j: usize| {
            pins[j] == NONE && patch(result.sites.triangles[j]) == patch(result.sites.triangles[i])
        };
        let others = (0..count).filter(|j| *j != i && twin(*j));
        let nearest = others
            .map(|j| result.sites.positions[j].distance(result.sites.positions[i]))
            .fold(f64::INFINITY, f64::min);
        assert!(nearest > 0.4 * last.spacing, "site {i} is {} spacings from another", nearest / last.spacing);
    }
    assert!(device.take_validation_messages().is_empty());
    result.steps
}

#[test]
fn sites_come_to_rest_between_curves() {
    for (name, count) in [("box", 600), ("thin-plate", 700), ("open-hemisphere", 500)] {
        let steps = relaxed(&sample(name).unwrap(), count);
        assert!(steps[39] < 0.01 && steps[39] < 0.1 * steps[0], "{name}: {steps:?}");
    }
}
