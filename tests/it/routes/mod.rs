//! Tests of single operations.

mod batches;
mod doubts;
mod estimate;
mod fits;
mod golden;
mod learned;
mod length_scales;
mod level_sets;
mod local;
mod model;
mod model_selection;
mod poor_fit;
mod repeated_rows;
mod sharp_edges;
mod solvers;
mod surfaces;
mod tiles;
mod units_differ;
mod unsolvable;
mod values;
