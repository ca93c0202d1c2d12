// Principal curvatures of a point cloud by CGAL's jet fitting (Cazals and Pouget 2003).
//
// Reads points from standard input, x y z each, and writes the seconds of neighbour search and fits, then the
// smaller and the larger principal curvature of each point. `cgal_jets NEIGHBOURS`.

#include <CGAL/Monge_via_jet_fitting.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Search = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<Kernel>>;
using Jets = CGAL::Monge_via_jet_fitting<Kernel>;

namespace {

// Degree of the polynomial; the differential quantities need 2.
constexpr std::size_t kFittingDegree = 4;
constexpr std::size_t kMongeDegree = 2;

std::vector<Point> read_points() {
    std::vector<Point> points;
    double x, y, z;
    while (std::scanf("%lf %lf %lf", &x, &y, &z) == 3) {
        points.emplace_back(x, y, z);
    }
    return points;
}

// The fit is centred at the first point of its range: the nearest neighbour of a point is the point itself.
std::pair<double, double> curvatures(const Search::Tree& tree, const Point& point, unsigned n_neighbours) {
    std::vector<Point> patch;
    for (const auto& [neighbour, squared_distance] : Search(tree, point, n_neighbours)) {
        patch.push_back(neighbour);
    }
    Jets jets;
    auto monge = jets(patch.begin(), patch.end(), kFittingDegree, kMongeDegree);
    return std::minmax({monge.principal_curvatures(0), monge.principal_curvatures(1)});
}

}  // namespace

int main(int argc, char** argv) {
    const unsigned n_neighbours = argc > 1 ? static_cast<unsigned>(std::atoi(argv[1])) : 30;
    const auto points = read_points();
    std::vector<std::pair<double, double>> found;
    found.reserve(points.size());
    const auto began = std::chrono::steady_clock::now();
    Search::Tree tree(points.begin(), points.end());
    tree.build();
    for (const auto& point : points) {
        found.push_back(curvatures(tree, point, n_neighbours));
    }
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - began;
    std::printf("%.9f\n", spent.count());
    for (const auto& [smaller, larger] : found) {
        std::printf("%.17g %.17g\n", smaller, larger);
    }
}
