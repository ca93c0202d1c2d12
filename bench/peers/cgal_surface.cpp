// Normals and curvatures of a point cloud by CGAL's jets (Cazals and Pouget 2003), on two threads, for
// bench/scale.
//
//     cgal_surface normals NEIGHBOURS DEGREE < POINTS > NORMALS   jet_estimate_normals
//     cgal_surface oriented NEIGHBOURS DEGREE < POINTS > NORMALS  the same and mst_orient_normals
//     cgal_surface curvatures NEIGHBOURS DEGREE < POINTS > ROWS   Monge_via_jet_fitting
//
// A row of curvatures is the normal, the smaller and the larger curvature.
//
// Points and results are float64, row by row; a curvature is positive where the surface bends away from the
// normal. To standard error go the seconds of the work alone and the peak resident memory in bytes.

#include <CGAL/Monge_via_jet_fitting.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/jet_estimate_normals.h>
#include <CGAL/mst_orient_normals.h>
#include <CGAL/property_map.h>
#include <tbb/global_control.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Vector = Kernel::Vector_3;
using Search = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<Kernel>>;
using Jets = CGAL::Monge_via_jet_fitting<Kernel>;
// Orientation reorders the points, so each carries its number.
using Oriented = std::tuple<Point, Vector, std::size_t>;

namespace {

constexpr std::size_t kThreads = 2;

std::vector<Point> read_points() {
    std::vector<Point> points;
    std::array<double, 3> x;
    while (std::fread(x.data(), sizeof(double), 3, stdin) == 3) {
        points.emplace_back(x[0], x[1], x[2]);
    }
    return points;
}

std::vector<double> normals(const std::vector<Point>& points, unsigned n_neighbours, std::size_t degree, bool is_oriented) {
    std::vector<Oriented> cloud;
    cloud.reserve(points.size());
    for (const auto& point : points) {
        cloud.emplace_back(point, Vector(0, 0, 0), cloud.size());
    }
    const auto parameters = CGAL::parameters::point_map(CGAL::Nth_of_tuple_property_map<0, Oriented>())
                                .normal_map(CGAL::Nth_of_tuple_property_map<1, Oriented>())
                                .degree_fitting(degree);
    CGAL::jet_estimate_normals<CGAL::Parallel_tag>(cloud, n_neighbours, parameters);
    if (is_oriented) {
        CGAL::mst_orient_normals(cloud, n_neighbours, parameters);
    }
    std::vector<double> rows(3 * points.size());
    for (const auto& [point, normal, index] : cloud) {
        for (int axis = 0; axis < 3; ++axis) {
            rows[3 * index + axis] = normal[axis];
        }
    }
    return rows;
}

long peak_bytes() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.rfind("VmHWM:", 0) == 0) {
            return 1024 * std::atol(line.c_str() + 6);
        }
    }
    return 0;
}

// The fit is centred at the first point of its range: the nearest neighbour of a point is the point itself.
std::vector<double> curvatures(const std::vector<Point>& points, unsigned n_neighbours, std::size_t degree) {
    Search::Tree tree(points.begin(), points.end());
    tree.build();
    std::vector<double> rows(5 * points.size());
    const auto fit = [&](std::size_t from) {
        std::vector<Point> patch;
        for (std::size_t i = from; i < points.size(); i += kThreads) {
            patch.clear();
            for (const auto& [neighbour, squared_distance] : Search(tree, points[i], n_neighbours)) {
                patch.push_back(neighbour);
            }
            Jets jets;
            const auto monge = jets(patch.begin(), patch.end(), degree, 2);
            const auto normal = monge.normal_direction();
            for (int axis = 0; axis < 3; ++axis) {
                rows[5 * i + axis] = normal[axis];
            }
            // CGAL counts bending towards the normal, the larger first.
            rows[5 * i + 3] = -monge.principal_curvatures(0);
            rows[5 * i + 4] = -monge.principal_curvatures(1);
        }
    };
    std::vector<std::thread> threads;
    for (std::size_t from = 0; from < kThreads; ++from) {
        threads.emplace_back(fit, from);
    }
    for (auto& thread : threads) {
        thread.join();
    }
    return rows;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 4) {
        std::fprintf(stderr, "cgal_surface normals|oriented|curvatures NEIGHBOURS DEGREE\n");
        return 2;
    }
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, kThreads);
    const std::string what = argv[1];
    const auto n_neighbours = static_cast<unsigned>(std::atoi(argv[2]));
    const auto degree = static_cast<std::size_t>(std::atoi(argv[3]));
    const auto points = read_points();
    const auto began = std::chrono::steady_clock::now();
    const auto rows = what == "curvatures" ? curvatures(points, n_neighbours, degree)
                                           : normals(points, n_neighbours, degree, what == "oriented");
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - began;
    std::fprintf(stderr, "%.9f %ld\n", spent.count(), peak_bytes());
    std::fwrite(rows.data(), sizeof(double), rows.size(), stdout);
}
