//! `--help`, shell completions and man pages.

use crate::support::place::Place;

const COMMANDS: [&str; 16] = [
    "remesh",
    "batch",
    "repair",
    "wrap",
    "follow",
    "measure",
    "inspect",
    "render",
    "presets",
    "sample",
    "devices",
    "demo",
    "bug-report",
    "completions",
    "man",
    "licences",
];

#[test]
fn shells_complete_every_command_and_its_options() {
    let place = Place::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let (script, errors) = place.run(&format!("completions {shell}"));
        assert_eq!(errors, "");
        for word in COMMANDS.into_iter().chain(["feature-angle", "shard", "against"]) {
            assert!(script.contains(word), "{shell} does not know {word}");
        }
        // Not every shell is told what values an option has.
        let knows = script.contains("draft");
        assert!(knows || ["powershell", "elvish"].contains(&shell), "{shell} knows no --quality");
    }
    // What bash makes of it.
    std::fs::write(place.path("bash.sh"), place.run("completions bash").0).unwrap();
    let script =
        "source ./bash.sh; COMP_WORDS=(rtfmesh ba); COMP_CWORD=1; _rtfmesh rtfmesh ba; echo ${COMPREPLY[@]}";
    let mut bash = assert_cmd::Command::new("bash");
    bash.current_dir(place.path("")).args(["-c", script]).assert().success().stdout("batch\n");
    place.program("completions tcsh").assert().code(2).stdout("");
}

#[test]
fn every_command_has_a_page_in_the_manual() {
    let place = Place::new();
    assert_eq!(place.run("man pages/man1"), Default::default());
    let page = |name: &str| std::fs::read_to_string(place.path("pages/man1").join(name)).unwrap();
    let whole = page("rtfmesh.1");
    assert_eq!(place.run("man"), (whole.clone(), String::new()), "without a folder it is printed");
    assert!(whole.contains(".SH NOTES") && whole.contains("Exit codes: 0 done, 2 usage"), "{whole}");
    for command in COMMANDS {
        let escaped = command.replace('-', "\\-");
        assert!(whole.contains(&format!("rtfmesh\\-{escaped}(1)")), "{command} is not in {whole}");
        let text = page(&format!("rtfmesh-{command}.1"));
        for wanted in [format!(".TH rtfmesh-{command} 1"), format!("\nrtfmesh {escaped} ")] {
            assert!(text.contains(&wanted), "'{wanted}' is missing: {text}");
        }
        assert!(text.contains(".SH SYNOPSIS") && text.contains(".SH EXAMPLES\n.nf\n"), "{text}");
    }
    assert!(page("rtfmesh-remesh.1").contains("\\-\\-feature\\-angle"), "options are explained");
    let count = std::fs::read_dir(place.path("pages/man1")).unwrap().count();
    assert_eq!(count, 1 + COMMANDS.len());
    std::fs::write(place.path("file"), "").unwrap();
    place.program("man file").assert().code(1).stdout("");
}

#[test]
fn the_page_of_options_is_that_of_the_program() {
    let (page, _) = Place::new().run("man --markdown");
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/options.md");
    let committed = std::fs::read_to_string(file).unwrap();
    assert!(page == committed, "renew docs/options.md: cargo run -- man --markdown > docs/options.md");
    for words in
        ["## rtfmesh remesh\n", "### Settings of presets\n", "- `-n`, `--vertices <N>`: ", "  - `draft`: "]
    {
        assert!(page.contains(words), "'{words}' is missing");
    }
    let longest = page.lines().map(|line| line.chars().count()).max().unwrap();
    assert!(longest <= 110, "a line has {longest} columns");
}

#[test]
fn short_help_fits_on_one_screen_and_long_help_has_everything() {
    let place = Place::new();
    for command in COMMANDS.map(|command| format!("{command} ")).iter().map(String::as_str).chain([""]) {
        for (flag, most) in [("-h", 45), ("--help", 150)] {
            let (help, _) = place.run(&format!("{command}{flag}"));
            let (lines, columns) = (help.lines().count(), help.lines().map(|l| l.chars().count()).max());
            assert!(
                lines <= most && columns <= Some(100),
                "{command}{flag}: {lines} lines, {columns:?} columns\n{help}"
            );
        }
    }
    assert_eq!(place.run("help remesh"), place.run("remesh --help"));
    let (short, _) = place.run("remesh -h");
    let (long, _) = place.run("remesh --help");
    let headings = |help: &str| -> Vec<String> {
        help.lines()
            .filter_map(|l| l.strip_suffix(':'))
            .filter(|l| !l.contains(' '))
            .map(str::to_owned)
            .collect()
    };
    let found = headings(&long);
    let wanted = ["Arguments", "Size", "Shape", "Features", "Sizing", "Input", "Attributes", "Output"];
    assert_eq!(found, [&wanted[..], &["Examples"]].concat(), "{long}");
    assert!(long.contains("\nDevice and time:\n") && !short.contains("--seed"), "{long}\n{short}");
    for option in ["--vertices", "--quality", "--sizing", "--report", "--device", "--help"] {
        assert!(short.contains(option) && long.contains(option), "{option} is missing: {short}");
    }
    for option in ["--gradation", "--weld", "--keep-partial", "--preset"] {
        assert!(!short.contains(option) && long.contains(option), "{option}: {short}\n{long}");
    }
}

#[test]
fn settings_of_presets_have_pages_of_their_own() {
    let place = Place::new();
    let (list, _) = place.run("presets");
    let (help, _) = place.run("remesh --help");
    let document = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/presets.md");
    let document = std::fs::read_to_string(document).unwrap();
    for (preset, own, foreign) in [
        ("rtf", &["--face", "--seeding", "--centroid", "--k-clip"][..], &["--offset", "--lbfgs"][..]),
        ("rpf", &["--offset <LENGTHS>", "[default: 0.5]"], &["--momentum"]),
        ("rvc", &["[default: cloud]", "--k-project"], &["--k-normal"]),
        ("rvd", &["--lbfgs", "--momentum"], &["--centroid", "--normals"]),
        ("cvd", &["[default: 0.9]"], &["--neighbours"]),
        ("mps", &["[default: poisson]", "no iterations"], &["--projection"]),
        ("default", &["remesh --help"], &["--face"]),
    ] {
        let (page, errors) = place.run(&format!("presets {preset}"));
        assert!(errors.is_empty() && page.starts_with(&format!("{preset}: ")), "{page}{errors}");
        assert!(list.contains(&format!("{preset} ")), "{preset} is not in {list}");
        for word in own {
            assert!(page.contains(word), "'{word}' is missing: {page}");
        }
        for word in foreign {
            assert!(!page.contains(word), "'{word}' does nothing: {page}");
        }
        for option in page.lines().filter_map(|line| line.trim_start().strip_prefix("--")) {
            let option = format!("--{}", option.split(' ').next().unwrap());
            assert!(document.contains(&format!("| `{option}`:")), "{option} is not in docs/presets.md");
            assert!(!help.contains(&format!("{option} ")), "{option} is in the help of remesh");
        }
    }
    place.program("presets none").assert().code(2).stdout("");
}

#[test]
fn the_help_of_every_command_ends_with_examples_of_it() {
    let place = Place::new();
    for command in COMMANDS {
        for flag in ["--help", "-h"] {
            let (help, errors) = place.run(&format!("{command} {flag}"));
            assert_eq!(errors, "");
            let (_, examples) = help.split_once("\nExamples:\n").unwrap_or_else(|| panic!("none in {help}"));
            for line in examples.trim_end().lines() {
                let call = format!("rtfmesh {command}");
                assert!(
                    line.starts_with("  ") && line.contains(&call),
                    "'{line}' is no example of {command}"
                );
            }
        }
    }
}
