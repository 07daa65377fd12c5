// Remeshes with geogram's library as its program vorpalite does: geogram_remesh IN OUT N LLOYD NEWTON,
// iterations of each kind. Prints the seconds inside remesh_smooth. Made by setup.sh.
//
// The package on PyPI is built without HLBFGS, which geogram needs for its Newton iterations; without it,
// geogram skips them silently. Its optimizers are a factory, so libLBFGS stands in: the same method
// with as many corrections.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <geogram/basic/command_line.h>
#include <geogram/basic/command_line_args.h>
#include <geogram/basic/common.h>
#include <geogram/mesh/mesh.h>
#include <geogram/mesh/mesh_io.h>
#include <geogram/mesh/mesh_remesh.h>
#include <geogram/numerics/optimizer.h>
#include <lbfgs.h>

namespace {

class LibLbfgs : public GEO::Optimizer {
public:
    void optimize(double* x) override {
        lbfgs_parameter_t parameters;
        lbfgs_parameter_init(&parameters);
        parameters.m = int(m_);
        parameters.max_iterations = int(max_iter_);
        parameters.epsilon = epsg_;
        double* at = lbfgs_malloc(int(n_));
        std::memcpy(at, x, n_ * sizeof(double));
        // It ends after the last iteration, or where no step lowers the value.
        const int ended = lbfgs(int(n_), at, nullptr, evaluate, progress, this, &parameters);
        if (ended < LBFGSERR_OUTOFINTERVAL) {
            std::fprintf(stderr, "lbfgs: error %d\n", ended);
            std::exit(1);
        }
        std::memcpy(x, at, n_ * sizeof(double));
        lbfgs_free(at);
    }

private:
    static double evaluate(void* self, const double* x, double* gradient, int n, double) {
        double value = 0.0;
        auto function = static_cast<LibLbfgs*>(self)->funcgrad_callback_;
        function(GEO::index_t(n), const_cast<double*>(x), value, gradient);
        return value;
    }

    static int progress(void* self, const double* x, const double* gradient, double value, double,
                        double norm, double, int n, int, int) {
        auto told = static_cast<LibLbfgs*>(self)->newiteration_callback_;
        if (told != nullptr) told(GEO::index_t(n), x, value, gradient, norm);
        return 0;
    }
};

} // namespace

int main(int argc, char** argv) {
    if (argc != 6) return 2;
    GEO::initialize(GEO::GEOGRAM_INSTALL_ALL);
    for (const char* group : {"standard", "algo", "opt", "remesh"}) GEO::CmdLine::import_arg_group(group);
    geo_register_Optimizer_creator(LibLbfgs, "HLBFGS");
    geo_register_Optimizer_creator(LibLbfgs, "default");
    GEO::Mesh in, out;
    if (!GEO::mesh_load(argv[1], in)) return 1;
    auto begin = std::chrono::steady_clock::now();
    GEO::remesh_smooth(in, out, GEO::index_t(std::atoi(argv[3])), 3, GEO::index_t(std::atoi(argv[4])),
                       GEO::index_t(std::atoi(argv[5])), 7);
    std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    if (!GEO::mesh_save(out, argv[2])) return 1;
    std::printf("seconds %.6f\n", seconds.count());
    return 0;
}
