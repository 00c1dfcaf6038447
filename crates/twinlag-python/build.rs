//! How an extension is linked that the interpreter loads: on macOS its symbols are found then.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
