//! What a run is asked to do: the same after writing and reading, and refused where it cannot be.

use glam::DVec3;
use rtfmesh::mesh::features::FeatureLine;
use rtfmesh::options::Face;
use rtfmesh::{
    CorrespondenceRequest, Error, FeatureLines, Length, MeasureDepth, Method, Options, Quality, Shortage,
    Sizing,
};

#[test]
fn options_are_the_same_after_writing_and_reading() {
    let line = FeatureLine { line: 3, points: vec![DVec3::ZERO, DVec3::new(0.1, -2.5, 1e-9)] };
    let full = Options::with_quality(500, Quality::Best)
        .features(FeatureLines::new(vec![line]))
        .fixed_half_edges(vec![4, 7])
        .sizing(Sizing::Given(vec![1.0, 0.1]))
        .min_edge(Length::OfDiagonal(0.01))
        .shortage(Shortage::AddVertices)
        .measures(MeasureDepth::Basic)
        .correspondence(CorrespondenceRequest::ALL)
        .tolerance(1.0 / 3.0)
        .seed(u64::MAX);
    let curved = Options::new(9).sizing(Sizing::Curvature { gradation: 1.5 }).max_edge(Length::Units(2.0));
    let presets = [Options::rtf, Options::rpf, Options::rvc, Options::rvd, Options::cvd, Options::mps];
    for options in presets.map(|preset| preset(70)).into_iter().chain([full, curved, Options::new(4)]) {
        let text = serde_json::to_string(&options).unwrap();
        assert_eq!(serde_json::from_str::<Options>(&text).unwrap(), options, "{text}");
    }
}

#[test]
fn what_is_left_out_is_as_by_default_and_unknown_names_are_refused() {
    let read = serde_json::from_str::<Options>;
    let some = r#"{ "vertices": 2000, "coarse_to_fine": { "feature_angle": 30.0 } }"#;
    assert_eq!(read(some).unwrap(), Options::new(2000).feature_angle(30.0));
    assert!(read("{}").unwrap().validate().is_err(), "nobody said how many vertices");
    for wrong in [r#"{ "vertex": 9 }"#, r#"{ "vertices": 9, "coarse_to_fine": { "angle": 3 } }"#] {
        assert!(read(wrong).unwrap_err().to_string().contains("unknown field"), "{wrong}");
    }
}

#[test]
fn settings_of_another_method_are_refused() {
    let wrong = [
        (Options::rtf(100).feature_angle(30.0), "coarse_to_fine"),
        (Options::new(100).face(Face::Power), "all_at_once"),
        (Options::cvd(100).method(Method::CoarseToFine), "all_at_once"),
        (Options::rtf(100).shortage(Shortage::AddVertices), "shortage"),
        (Options::new(100).growth(-1.0), "growth"),
        (Options::rtf(100).momentum(1.2), "momentum"),
    ];
    for (options, name) in wrong {
        match options.validate() {
            Err(Error::Usage { field, problem, .. }) => {
                assert_eq!(field, Some(name));
                assert!(problem.starts_with(&format!("`{name}`")), "{problem}");
            }
            other => panic!("{name}: {other:?}"),
        }
    }
}
