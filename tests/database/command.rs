//! `knotmesh relax --backend database`.
