//! Device memory: the estimate, refusal before anything is allocated, and limits that hold.

use crate::support::place::Place;
use crate::support::shapes::plane;
use rtfmesh::gpu::Buffer;
use rtfmesh::mesh::samples::sample;
use rtfmesh::{
    Device, DeviceOptions, Error, Flow, MeasureDepth, Options, Phase, Progress, preview, remesh,
    remesh_with_progress,
};

fn limited(memory_bytes: u64) -> Device {
    Device::open(&DeviceOptions::from_env().memory_bytes(Some(memory_bytes))).unwrap()
}

fn options(vertices: usize) -> Options {
    Options::new(vertices).iterations(2).measures(MeasureDepth::Basic).polish_rounds(1)
}

#[test]
fn a_device_has_no_more_than_its_memory_or_the_limit() {
    let all = Device::open(&DeviceOptions::from_env()).unwrap();
    let heap = all.info().limits.memory_bytes;
    // A CPU has the memory of the machine; Mesa gives a constant as its size.
    let most = if all.info().kind == "cpu" { 1 << 44 } else { heap };
    assert!((1..=most).contains(&all.available_bytes()), "{} of {heap}", all.available_bytes());
    assert_eq!(limited(5 << 20).available_bytes(), 5 << 20);
    assert_eq!(limited(5 << 20).info().limits.memory_bytes, heap);
}

#[test]
fn the_preview_estimates_the_memory_of_a_run() {
    let input = sample("torus").unwrap();
    for options in [options(4000), Options::rtf(1500).iterations(10)] {
        // A device that has no memory left to polish leaves it to the host, so the estimate leaves it out.
        let device = Device::open(&DeviceOptions::from_env().polish(false)).unwrap();
        let estimated = preview(&input, &options).unwrap().device_bytes as f64;
        remesh(&device, &input, &options).unwrap();
        let taken = device.peak_bytes() as f64;
        // The estimate does not count copies to and from the host.
        assert!(
            (0.6..1.2).contains(&(estimated / taken)),
            "{:?}: {estimated} estimated, {taken} taken",
            options.method
        );
    }
}

#[test]
fn what_does_not_fit_is_refused_before_it_begins() {
    let input = sample("torus").unwrap();
    let needed = preview(&input, &options(20_000)).unwrap().device_bytes;
    let device = limited(needed / 2);
    let mut calls = 0;
    let error = remesh_with_progress(&device, &input, &options(20_000), |_| calls += 1).unwrap_err();
    let Error::OutOfMemory { what, bytes, problem, remedy, .. } = &error else { panic!("{error:?}") };
    assert_eq!((what.as_str(), *bytes), ("the run", needed));
    assert!(
        problem.contains(&device.info().name) && problem.contains(&(needed / 2).to_string()),
        "{problem}"
    );
    assert!(device.peak_bytes() < 1000, "nothing of that size was allocated");
    // The count that the remedy advises is the largest that is accepted.
    let advised = remedy.split_whitespace().find_map(|word| word.parse::<usize>().ok()).unwrap();
    assert!((9_000..10_000).contains(&advised), "{remedy}");
    let stop = |progress: Progress| {
        if progress.phase > Phase::Prepare { Flow::Cancel } else { Flow::Continue }
    };
    let begins = |vertices| match remesh_with_progress(&device, &input, &options(vertices), stop) {
        Err(Error::Cancelled) => true,
        Err(Error::OutOfMemory { what, .. }) if what == "the run" => false,
        other => panic!("{other:?}"),
    };
    assert!(begins(advised) && !begins(advised + 1), "{remedy}");
    let error = remesh(&limited(1000), &input, &options(100)).unwrap_err().to_string();
    assert!(error.contains("simplify the input"), "{error}");
}

#[test]
fn an_input_with_too_many_triangles_is_refused_with_the_number_that_fits() {
    let device = Device::open(&DeviceOptions::from_env().least_limits(true)).unwrap();
    // Exact faces have all triangles in one list, each with three positions.
    let input = plane(1200, 0.0);
    let error = remesh(&device, &input, &Options::rvd(1000)).unwrap_err();
    let Error::OutOfMemory { what, problem, remedy, .. } = &error else { panic!("{error:?}") };
    assert!(what.contains("2880000 triangles") && problem.contains("134217728"), "{error}");
    assert!(remedy.contains("to 2796202 triangles"), "{error}");
    assert!(device.peak_bytes() < 1000, "something was allocated");
}

#[test]
fn memory_that_grows_with_the_count_is_in_the_remedy() {
    // Twelve triangles, which are subdivided to the spacing of the sites.
    let input = sample("box").unwrap();
    let options = |vertices| Options::rtf(vertices).iterations(1);
    let needed = |vertices| preview(&input, &options(vertices)).unwrap().device_bytes;
    let available = needed(1_000);
    let error = remesh(&limited(available), &input, &options(20_000)).unwrap_err();
    let Error::OutOfMemory { bytes, remedy, .. } = &error else { panic!("{error:?}") };
    assert_eq!(*bytes, needed(20_000));
    let advised = remedy.split_whitespace().find_map(|word| word.parse::<usize>().ok()).unwrap();
    assert!(advised >= 1_000, "{remedy}");
    assert!(needed(advised) <= available && needed(advised + 1) > available, "{remedy}");
}

#[test]
fn no_buffer_exceeds_the_limit() {
    let device = limited(1 << 20);
    let half = Buffer::<u32>::new(&device, "test.half", 1 << 17).unwrap();
    let error = Buffer::<u32>::new(&device, "test.more", (1 << 17) + 4).err().unwrap();
    assert!(matches!(&error, Error::OutOfMemory { what, .. } if what == "test.more"), "{error}");
    assert!(error.to_string().contains("1048576"), "{error}");
    drop(half);
    assert!(Buffer::<u32>::new(&device, "test.more", (1 << 17) + 4).is_ok());
}

#[test]
fn the_program_refuses_with_the_numbers() {
    let place = Place::with("torus");
    let run = "remesh in.ply out.ply -n 20000 --device-memory 2";
    let done = place.program(run).assert().code(4).stdout("");
    let line = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    assert!(
        line.lines().count() == 1 && line.contains("2097152") && line.contains("ask for at most"),
        "{line}"
    );
    assert_eq!(place.files(), ["in.ply"]);
    place.program("remesh in.ply out.ply -n 100 --device-memory 0").assert().code(2);
    place.run("remesh in.ply out.ply -n 200 --device-memory 64 --iterations 2 --quality draft -q");
}
