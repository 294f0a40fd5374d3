//! The `knotmesh` command.

mod cli;

fn main() -> std::process::ExitCode {
    quieten_driver();
    cli::run()
}

/// Mesa's layer that picks a device for others complains on standard error where there is no desktop. Adapters are picked
/// here, so it is not needed.
fn quieten_driver() {
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        #[allow(unsafe_code)]
        // SAFETY: no other thread runs yet.
        unsafe {
            std::env::set_var("NODEVICE_SELECT", "1");
        }
    }
}
