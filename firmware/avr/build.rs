//! Places the bootloaders into the boot section, and leaves out the C library's start files there.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    for loader in ["sensor-loader", "steering-loader"] {
        for argument in ["-nostartfiles", "-Wl,--section-start=.text=0x1f000"] {
            println!("cargo::rustc-link-arg-bin={loader}={argument}");
        }
    }
}
