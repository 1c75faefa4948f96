// The module `vcp` for Python: vcp.hpp with NumPy arrays. During calls that take long, other threads of Python run.
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstring>
#include <optional>
#include <variant>

#include "viewer/widget/vcp.hpp"

namespace py = pybind11;
using namespace vcp::widget;

namespace {

using Triple = std::array<double, 3>;
Triple triple(const double* values) { return {values[0], values[1], values[2]}; }

py::dict toDict(const vcp_camera& camera) {
    using namespace py::literals;
    return py::dict("position"_a = triple(camera.position), "target"_a = triple(camera.target),
                    "up"_a = triple(camera.up), "fov_y"_a = camera.fov_y, "orthographic"_a = camera.orthographic != 0);
}

/// Returns the view's camera, changed by the keywords.
vcp_camera changed(vcp_camera camera, const py::kwargs& fields) {
    const auto set = [](double* to, const py::handle& value) {
        const auto from = value.cast<Triple>();
        std::copy(from.begin(), from.end(), to);
    };
    for (const auto& [key, value] : fields) {
        const auto name = key.cast<std::string>();
        if (name == "position")
            set(camera.position, value);
        else if (name == "target")
            set(camera.target, value);
        else if (name == "up")
            set(camera.up, value);
        else if (name == "fov_y")
            camera.fov_y = value.cast<double>();
        else if (name == "orthographic")
            camera.orthographic = value.cast<bool>() ? 1 : 0;
        else
            throw py::type_error("a camera has no " + name);
    }
    return camera;
}

py::dict toDict(const vcp_stats& s) {
    using namespace py::literals;
    return py::dict("settled"_a = s.settled != 0, "relaxed"_a = s.relaxed != 0, "frames"_a = s.frames,
                    "frame_ms"_a = s.frame_ms, "error_pixels"_a = s.error_pixels, "rays"_a = s.rays,
                    "hit_pixels"_a = s.hit_pixels, "samples"_a = s.samples, "detail"_a = s.detail,
                    "resident_bytes"_a = s.resident_bytes, "pool_bytes"_a = s.pool_bytes, "bytes_read"_a = s.bytes_read,
                    "pages_resident"_a = s.pages_resident, "pages_drawn"_a = s.pages_drawn,
                    "device_losses"_a = s.device_losses);
}

py::object pickOf(View& view, double x, double y) {
    using namespace py::literals;
    vcp_pick p;
    {
        const py::gil_scoped_release others;
        p = view.pick(x, y);
    }
    if (p.hit == 0) return py::none();
    return py::dict("position"_a = triple(p.position), "normal"_a = triple(p.normal), "distance"_a = p.distance,
                    "error"_a = p.error, "level"_a = p.level, "dataset"_a = p.dataset);
}

/// Returns (height, width, 4) of uint8, and (height, width) of float32.
py::tuple frameOf(View& view) {
    const Frame frame = view.read();
    py::array_t<uint8_t> rgba({py::ssize_t(frame.height), py::ssize_t(frame.width), py::ssize_t(4)});
    py::array_t<float> depth({py::ssize_t(frame.height), py::ssize_t(frame.width)});
    std::memcpy(rgba.mutable_data(), frame.rgba.data(), frame.rgba.size());
    std::memcpy(depth.mutable_data(), frame.depth.data(), 4 * frame.depth.size());
    return py::make_tuple(rgba, depth);
}

py::dict buildWith(const std::vector<std::string>& inputs, const std::string& output, double cell, double error,
                   uint64_t memoryBytes, uint32_t threads, const py::object& progress) {
    using namespace py::literals;
    vcp_build_options options = sized<vcp_build_options>();
    options.cell = cell;
    options.error = error;
    options.memory_bytes = memoryBytes;
    options.threads = threads;
    std::exception_ptr thrown;
    // Returning false cancels; so does an exception, which is passed on.
    const auto tell = [&](const vcp_progress& at) {
        const py::gil_scoped_acquire python;
        try {
            const py::object answer = progress.is_none() ? py::none() : progress(at.stage, at.fraction);
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
            return answer.is_none() || answer.cast<bool>();
        } catch (...) {
            thrown = std::current_exception();
            return false;
        }
    };
    vcp_build_report report{};
    try {
        const py::gil_scoped_release others;
        report = build(inputs, output, tell, options);
    } catch (const Error&) {
        if (!thrown) throw;
    }
    if (thrown) std::rethrow_exception(thrown);
    return py::dict("triangles"_a = report.triangles, "levels"_a = report.levels, "file_bytes"_a = report.file_bytes,
                    "cell"_a = report.cell, "certified_error"_a = report.certified_error, "seconds"_a = report.seconds);
}

/// One path, or several with a matrix of 16 numbers each, row by row, or none.
using Paths = std::variant<std::string, std::vector<std::pair<std::string, std::optional<std::array<double, 16>>>>>;

/// Opens a view that keeps its context alive.
std::unique_ptr<View> openView(const Paths& paths, uint32_t width, uint32_t height, uint64_t gpuBytes,
                               const std::string& device, bool zIsUp) {
    vcp_context_options options = sized<vcp_context_options>();
    options.gpu_bytes = gpuBytes;
    options.device = device.c_str();
    Context context(options);
    if (const auto* path = std::get_if<std::string>(&paths)) {
        context.open(*path);
    } else {
        std::vector<Placed> placed;
        for (const auto& [each, matrix] : std::get<1>(paths))
            placed.push_back({each, matrix.value_or(std::array<double, 16>{})});
        context.open(placed);
    }
    vcp_view_options how = sized<vcp_view_options>();
    how.width = width;
    how.height = height;
    how.z_is_up = zIsUp ? 1 : 0;
    return std::make_unique<View>(std::move(context), how);
}

py::dict datasetOf(const View& view) {
    using namespace py::literals;
    const vcp_dataset_info info = view.context().dataset();
    return py::dict("triangles"_a = info.triangles, "levels"_a = info.levels, "bounds_min"_a = triple(info.bounds_min),
                    "bounds_max"_a = triple(info.bounds_max), "cell"_a = info.cell,
                    "certified_error"_a = info.certified_error, "datasets"_a = info.datasets);
}

}  // namespace

PYBIND11_MODULE(vcp, module) {
    using namespace py::literals;
    module.doc() = "Views of .vcp files, and how to build them.";
    module.attr("__version__") = vcp_version();
    py::register_exception<Error>(module, "Error", PyExc_RuntimeError);
    module.def("build", buildWith, "inputs"_a, "output"_a, "cell"_a = 0.0, "error"_a = 0.0, "memory_bytes"_a = 0,
               "threads"_a = 0, "progress"_a = py::none(),
               "Meshes to one .vcp file. progress(stage, fraction) returns False to cancel.");
    module.def("open", openView, "path"_a, "width"_a = 1280, "height"_a = 720, "gpu_bytes"_a = 0, "device"_a = "",
               "z_is_up"_a = false, py::call_guard<py::gil_scoped_release>(),
               "A view of a .vcp file or its http(s) address, of a scene file (.json), or of several: [(path, matrix), "
               "...], the "
               "matrix 16 numbers row by row, or None.");
    py::class_<View>(module, "View")
        .def("resize", &View::resize, "width"_a, "height"_a)
        .def("settle", &View::settle, "seconds"_a = 60.0, py::call_guard<py::gil_scoped_release>(),
             "Loads and draws all that the view wants; False where the time was over.")
        .def("render", frameOf,
             "The last picture: RGBA of shape (height, width, 4), depth of shape (height, width), infinite where "
             "nothing is.")
        .def("pick", pickOf, "x"_a, "y"_a, "What is at a pixel, on the finest level; None where nothing is.")
        .def(
            "set_camera", [](View& view, const py::kwargs& fields) { view.setCamera(changed(view.camera(), fields)); },
            "position, target, up, fov_y, orthographic.")
        .def("act", &View::act, "action"_a)
        .def(
            "set_budgets", [](View& view, uint64_t gpu, uint64_t ram) { Context(view.context()).setBudgets(gpu, ram); },
            "gpu_bytes"_a, "ram_bytes"_a = 0)
        .def_property(
            "samples", [](const View& view) { return view.look().samples; },
            [](View& view, uint32_t samples) {
                vcp_look look = view.look();
                look.samples = samples;
                view.setLook(look);
            },
            "Rays a pixel of a picture that is settled, 1 to 64: smooth edges.")
        .def_property_readonly("camera", [](const View& view) { return toDict(view.camera()); })
        .def_property_readonly("stats", [](const View& view) { return toDict(view.stats()); })
        .def_property_readonly("dataset", datasetOf)
        .def_property_readonly("device", [](const View& view) { return std::string(view.context().device().name); });
    for (const auto& [name, action] : {std::pair{"FIT", VCP_FIT},
                                       {"FRONT", VCP_VIEW_FRONT},
                                       {"RIGHT", VCP_VIEW_RIGHT},
                                       {"TOP", VCP_VIEW_TOP},
                                       {"ISOMETRIC", VCP_VIEW_ISOMETRIC},
                                       {"NEXT_SHADING", VCP_NEXT_SHADING}})
        module.attr(name) = int(action);
}
