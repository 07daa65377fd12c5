// Lays a surface through points with geogram's library as its program vorpalite does with co3ne=true:
// geogram_reconstruct IN.xyz OUT.ply. Prints the seconds inside. Made by setup.sh.
#include <chrono>
#include <cstdio>
#include <fstream>
#include <geogram/basic/command_line.h>
#include <geogram/basic/command_line_args.h>
#include <geogram/basic/common.h>
#include <geogram/mesh/mesh.h>
#include <geogram/mesh/mesh_geometry.h>
#include <geogram/mesh/mesh_io.h>
#include <geogram/mesh/mesh_repair.h>
#include <geogram/points/co3ne.h>
#include <vector>

namespace {

// The defaults of vorpalite's options.
constexpr GEO::index_t NEIGHBOURS = 30, SMOOTHING_ITERATIONS = 2;
constexpr double RADIUS_PERCENT = 5.0;

bool read(const char* path, GEO::Mesh& points) {
    std::ifstream file(path);
    std::vector<GEO::vec3> all;
    for (GEO::vec3 p; file >> p.x >> p.y >> p.z;) all.push_back(p);
    points.vertices.set_dimension(3);
    const GEO::index_t first = points.vertices.create_vertices(GEO::index_t(all.size()));
    for (GEO::index_t i = 0; i < all.size(); ++i) {
        for (GEO::index_t k = 0; k < 3; ++k) points.vertices.point_ptr(first + i)[k] = all[i][k];
    }
    return !all.empty();
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    GEO::initialize(GEO::GEOGRAM_INSTALL_ALL);
    for (const char* group : {"standard", "algo", "co3ne"}) GEO::CmdLine::import_arg_group(group);
    GEO::Mesh mesh;
    if (!read(argv[1], mesh)) return 1;
    auto begin = std::chrono::steady_clock::now();
    const double diagonal = GEO::bbox_diagonal(mesh);
    GEO::mesh_repair(mesh, GEO::MESH_REPAIR_COLOCATE, 1e-6 * diagonal);
    GEO::Co3Ne_smooth(mesh, NEIGHBOURS, SMOOTHING_ITERATIONS);
    GEO::Co3Ne_reconstruct(mesh, 0.01 * RADIUS_PERCENT * diagonal);
    std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    if (!GEO::mesh_save(mesh, argv[2])) return 1;
    std::printf("seconds %.6f\n", seconds.count());
    return 0;
}
