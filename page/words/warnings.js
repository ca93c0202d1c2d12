// @ts-check
// Warnings and reasons of flags in the words of the page.

/**
 * Warnings by their codes. `share` is the part of the points that a warning is about, in words.
 *
 * @type {Record<string, (share: string) => string>}
 */
export const WARNINGS = {
  ill_conditioned: () =>
    "The kernel is nearly too smooth for points so close together; more noise α makes error bars safer",
  refined: () => "The solution was refined, and is accurate",
  duplicates_merged: () => "Equal points were merged",
  repeated_rows: () => "Repeated points count once",
  units_differ: () => "The axes have very different extents, and share one length scale; give them the same unit",
  variance_clamped: () => "Some error bars are below what computers can tell from zero",
  offset_model_used: (share) => `At ${share} the surface comes from nearby points alone`,
  orientation_repaired: (share) => `At ${share} the normal was turned outward`,
  open_cloud: () => "The points have a rim, so the outer side is a guess",
  kernel_too_rough: (share) => `At ${share} the kernel is too rough for curvatures; raise ε, or take another kernel`,
  disagrees_with_neighbours: (share) => `At ${share} nothing around confirms the curvature`,
  neighbours_not_enough: () => "More neighbours would change the values noticeably; the solver dense uses all points",
  poor_fit: () => "The points contradict kernel and noise, so error bars are too short",
  parts_dropped: () => "Small pieces without points near them were left out of the mesh",
  bridged: () => "The mesh closes holes in which there are no points; “Support of each vertex” shows them",
  far_vertices: () => "Parts of the mesh are far from all points; do not rely on them",
  sharp_edges: (share) => `At ${share} two sheets meet at a sharp edge, where curvature has no meaning`,
  raw_mesh: () =>
    "Triangles were left irregular, since regular ones would have changed the shape; a shorter step may help",
  far_from_cloud: (share) => `${share} are far from the cloud`,
};

/** Reasons of flags. @type {Record<string, string>} */
export const REASONS = {
  vanishing_gradient: "without a normal: the surface is not determined there",
  unaffordable_rescue: "without a normal: there are too many such points",
  kernel_too_rough: "where the kernel is too rough for curvatures",
  far_from_cloud: "far from the cloud",
  under_resolved: "with too few points for so much curvature",
  ambiguous_side: "whose normal may point inward",
  edge: "at a sharp edge",
  uncertain: "less certain than most",
};

/**
 * A warning in a sentence without a full stop.
 *
 * @param {{ code?: string, detail: string }} warning
 */
export function warningInWords({ code = "", detail }) {
  if (!Object.hasOwn(WARNINGS, code)) return detail;
  const [, n, of] = detail.match(/\(queries: (\d+) of (\d+)\)/) ?? [];
  const share = n === undefined ? "some points" : n === of ? "all points" : `${many(n)} of ${many(of)} points`;
  return WARNINGS[code](share);
}

function many(digits) {
  return Number(digits).toLocaleString("en");
}
