//! The native part of the Python package `rtfmesh`. Arguments have been checked and converted by the
//! package's own modules, which alone call this one.

mod attributes;
mod device;
mod errors;
mod figures;
mod files;
mod follow;
mod locate;
mod mesh;
mod program;
mod repair;
mod run;
mod work;

use pyo3::prelude::*;

/// Called by the package's other modules; see there.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<device::Device>()?;
    module.add_class::<attributes::Materials>()?;
    module.add_function(wrap_pyfunction!(device::devices, module)?)?;
    module.add_function(wrap_pyfunction!(run::remesh, module)?)?;
    module.add_function(wrap_pyfunction!(run::check, module)?)?;
    module.add_function(wrap_pyfunction!(run::options, module)?)?;
    module.add_function(wrap_pyfunction!(figures::measure, module)?)?;
    module.add_function(wrap_pyfunction!(figures::inspect, module)?)?;
    module.add_function(wrap_pyfunction!(figures::render, module)?)?;
    module.add_function(wrap_pyfunction!(follow::follow, module)?)?;
    module.add_function(wrap_pyfunction!(locate::locate, module)?)?;
    module.add_function(wrap_pyfunction!(repair::repair, module)?)?;
    module.add_function(wrap_pyfunction!(files::read, module)?)?;
    module.add_function(wrap_pyfunction!(files::sample, module)?)?;
    module.add_function(wrap_pyfunction!(files::write, module)?)?;
    module.add_function(wrap_pyfunction!(program::run_program, module)?)
}
