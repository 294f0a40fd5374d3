//! `--device` and `--adapter`: what frames are solved on.

use knotmesh::backend::DeviceKind;

#[derive(clap::Args)]
pub struct DeviceArguments {
    /// gpu takes the best adapter there is; auto takes one of hardware if there is one and else the CPU, and goes on on the
    /// CPU if it fails.
    #[arg(long, value_enum, default_value = "auto")]
    pub device: DeviceName,
    /// The adapter to take, by a part of its name; `knotmesh info --adapters` lists them.
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum DeviceName {
    Auto,
    Gpu,
    Cpu,
}

impl From<DeviceName> for DeviceKind {
    fn from(name: DeviceName) -> Self {
        match name {
            DeviceName::Auto => Self::Auto,
            DeviceName::Gpu => Self::Gpu,
            DeviceName::Cpu => Self::Cpu,
        }
    }
}
