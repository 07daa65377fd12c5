//! The headings under which `--help` and docs/options.md list options.

pub const SIZE: &str = "Size";
pub const SHAPE: &str = "Shape";
pub const FEATURES: &str = "Features";
pub const SIZING: &str = "Sizing";
pub const ATTRIBUTES: &str = "Attributes";
pub const INPUT: &str = "Input";
pub const OUTPUT: &str = "Output";
pub const DEVICE: &str = "Device and time";
pub const COLOURS: &str = "Colours and lines";
pub const CAMERA: &str = "Camera";
