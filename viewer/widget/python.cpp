// The module of the package `vcp` for Python: vcp.hpp with NumPy arrays. During calls that take long, other threads of
// Python run.
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <optional>
#include <tuple>
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

/// Copies three numbers of Python's to floats or doubles.
template <class Number>
void set(Number* to, const py::handle& value) {
    const auto from = value.cast<Triple>();
    for (size_t i = 0; i < from.size(); ++i) to[i] = Number(from[i]);
}

/// Returns the view's camera, changed by the keywords.
vcp_camera changed(vcp_camera camera, const py::kwargs& fields) {
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

constexpr const char* kShadings[] = {"lit",   "clay",    "unlit", "normals", "steps",
                                     "cells", "fetches", "level", "error",   "wireframe"};
static_assert(std::size(kShadings) == VCP_SHADING_WIREFRAME + 1);

Triple triple(const float* values) { return {values[0], values[1], values[2]}; }

vcp_shading shadingNamed(const std::string& name) {
    const auto* const found = std::find(std::begin(kShadings), std::end(kShadings), name);
    if (found == std::end(kShadings)) throw py::value_error("there is no shading " + name);
    return vcp_shading(found - std::begin(kShadings));
}

using Plane = std::array<double, 4>;

/// Caps as Python has them: False, True for closed parts, "all".
py::object capsOf(uint32_t caps) { return caps == 2 ? py::object(py::str("all")) : py::object(py::bool_(caps != 0)); }

uint32_t capsFrom(const py::handle& value) {
    if (!py::isinstance<py::str>(value)) return value.cast<bool>() ? 1 : 0;
    if (value.cast<std::string>() != "all") throw py::value_error("caps are True, False or \"all\"");
    return 2;
}

py::dict toDict(const vcp_look& look) {
    using namespace py::literals;
    std::vector<Plane> sections;
    for (uint32_t i = 0; i < look.section_count; ++i) {
        const double* plane = look.sections[i];
        sections.push_back({plane[0], plane[1], plane[2], plane[3]});
    }
    return py::dict("shading"_a = kShadings[look.shading], "error_pixels"_a = look.error_pixels,
                    "shadows"_a = look.shadows != 0, "occlusion_rays"_a = look.occlusion_rays,
                    "occlusion_radius"_a = look.occlusion_radius, "light"_a = triple(look.light),
                    "light_in_world"_a = look.light_in_world != 0, "transparent"_a = look.transparent != 0,
                    "background_top"_a = triple(look.background_top),
                    "background_bottom"_a = triple(look.background_bottom), "sections"_a = sections,
                    "section_caps"_a = capsOf(look.section_caps), "samples"_a = look.samples,
                    "colour_error"_a = look.colour_error, "plain"_a = look.plain != 0);
}

void setSections(vcp_look& look, const std::vector<Plane>& planes) {
    if (planes.size() > std::size(look.sections)) throw py::value_error("there are more than 6 section planes");
    look.section_count = uint32_t(planes.size());
    for (size_t i = 0; i < planes.size(); ++i) std::copy(planes[i].begin(), planes[i].end(), look.sections[i]);
}

/// Returns the view's look, changed by the keywords.
vcp_look changed(vcp_look look, const py::kwargs& fields) {
    for (const auto& [key, value] : fields) {
        const auto name = key.cast<std::string>();
        const auto flag = [&, &value = value] { return value.cast<bool>() ? 1u : 0u; };
        if (name == "shading")
            look.shading = shadingNamed(value.cast<std::string>());
        else if (name == "error_pixels")
            look.error_pixels = value.cast<double>();
        else if (name == "colour_error")
            look.colour_error = value.cast<double>();
        else if (name == "plain")
            look.plain = flag();
        else if (name == "shadows")
            look.shadows = flag();
        else if (name == "occlusion_rays")
            look.occlusion_rays = value.cast<uint32_t>();
        else if (name == "occlusion_radius")
            look.occlusion_radius = value.cast<double>();
        else if (name == "light")
            set(look.light, value);
        else if (name == "light_in_world")
            look.light_in_world = flag();
        else if (name == "transparent")
            look.transparent = flag();
        else if (name == "background_top")
            set(look.background_top, value);
        else if (name == "background_bottom")
            set(look.background_bottom, value);
        else if (name == "sections")
            setSections(look, value.cast<std::vector<Plane>>());
        else if (name == "section_caps")
            look.section_caps = capsFrom(value);
        else if (name == "samples")
            look.samples = value.cast<uint32_t>();
        else
            throw py::type_error("a look has no " + name);
    }
    return look;
}

py::dict toDict(const vcp_stats& s) {
    using namespace py::literals;
    return py::dict("settled"_a = s.settled != 0, "relaxed"_a = s.relaxed != 0, "frames"_a = s.frames,
                    "frame_ms"_a = s.frame_ms, "error_pixels"_a = s.error_pixels, "rays"_a = s.rays,
                    "hit_pixels"_a = s.hit_pixels, "samples"_a = s.samples, "detail"_a = s.detail,
                    "resident_bytes"_a = s.resident_bytes, "pool_bytes"_a = s.pool_bytes, "bytes_read"_a = s.bytes_read,
                    "pages_resident"_a = s.pages_resident, "pages_drawn"_a = s.pages_drawn,
                    "device_losses"_a = s.device_losses, "processor_rays"_a = s.processor_rays != 0,
                    "colour_limits"_a = s.colour_limits != 0, "colour_pixels"_a = s.colour_pixels);
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
                    "error"_a = p.error, "level"_a = p.level,
                    "dataset"_a = p.dataset == VCP_NO_DATASET ? py::object(py::none()) : py::int_(p.dataset));
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

vcp_colour colourNamed(const std::string& name) {
    constexpr const char* kNames[] = {"auto", "vertex", "texture", "none"};
    const auto* const found = std::find(std::begin(kNames), std::end(kNames), name);
    if (found == std::end(kNames)) throw py::value_error("there is no colour " + name);
    return vcp_colour(found - std::begin(kNames));
}

py::dict buildWith(const std::vector<std::filesystem::path>& files, const std::filesystem::path& output, double cell,
                   double error, uint64_t memoryBytes, uint32_t threads, const std::string& colour,
                   const std::string& format, const py::object& progress) {
    using namespace py::literals;
    vcp_build_options options = sized<vcp_build_options>();
    options.colour = colourNamed(colour);
    options.format = format.c_str();
    options.cell = cell;
    options.error = error;
    options.memory_bytes = memoryBytes;
    options.threads = threads;
    std::vector<std::string> inputs;
    for (const std::filesystem::path& file : files) inputs.push_back(file.string());
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
        report = build(inputs, output.string(), tell, options);
    } catch (const Error&) {
        if (!thrown) throw;
    }
    if (thrown) std::rethrow_exception(thrown);
    return py::dict("triangles"_a = report.triangles, "levels"_a = report.levels, "file_bytes"_a = report.file_bytes,
                    "cell"_a = report.cell, "certified_error"_a = report.certified_error, "seconds"_a = report.seconds);
}

/// One path, or several with a matrix of 16 numbers each, row by row, or none. A path is a str or an os.PathLike.
using Paths = std::variant<std::filesystem::path,
                           std::vector<std::pair<std::filesystem::path, std::optional<std::array<double, 16>>>>>;

std::vector<Placed> placedOf(const Paths& paths) {
    std::vector<Placed> placed;
    for (const auto& [each, matrix] : std::get<1>(paths))
        placed.push_back({each.string(), matrix.value_or(std::array<double, 16>{})});
    return placed;
}

/// Opens in the background, and tells progress(opened, datasets) until it is done; False cancels.
void openTelling(Context& context, const Paths& paths, const py::object& progress) {
    {
        const py::gil_scoped_release others;
        if (const auto* path = std::get_if<std::filesystem::path>(&paths))
            context.startOpen(path->string());
        else
            context.startOpen(placedOf(paths));
    }
    for (;;) {
        vcp_opening at;
        {
            const py::gil_scoped_release others;
            context.wait(0.1);
            at = context.opening();
        }
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        if (at.under_way == 0) return;
        const py::object answer = progress.is_none() ? py::none() : progress(at.opened, at.datasets);
        if (!answer.is_none() && !answer.cast<bool>()) context.cancelOpening();
    }
}

/// Opens a view that keeps its context alive.
std::unique_ptr<View> openView(const Paths& paths, uint32_t width, uint32_t height, uint64_t gpuBytes,
                               const std::string& device, bool zIsUp, const py::object& progress) {
    if (width == 0 || height == 0) throw Error(VCP_USAGE, "a picture has 1 to 16384 pixels a side");
    vcp_context_options options = sized<vcp_context_options>();
    options.gpu_bytes = gpuBytes;
    options.device = device.c_str();
    Context context = [&] {
        const py::gil_scoped_release others;
        return Context(options);
    }();
    openTelling(context, paths, progress);
    const py::gil_scoped_release others;
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

/// Returns the view, where it was not closed. Errors: VCP_USAGE.
View& opened(View& view) {
    if (!view.handle()) throw Error(VCP_USAGE, "the view was closed");
    return view;
}

/// Destroys the view, and its context with its last view.
void close(View& view) { const View gone = std::move(view); }

/// Points of a line, colour and width.
using LineOf = std::tuple<std::vector<std::array<double, 3>>, std::array<float, 4>, float>;

void setLines(View& view, const std::vector<LineOf>& lines) {
    std::vector<Line> all;
    for (const auto& [points, colour, width] : lines) all.push_back({points, colour, width});
    view.setLines(all);
}

void setLook(View& view, const py::kwargs& fields) { view.setLook(changed(view.look(), fields)); }

void setSections(View& view, const std::vector<Plane>& planes, const py::object& caps) {
    vcp_look look = view.look();
    setSections(look, planes);
    look.section_caps = capsFrom(caps);
    view.setLook(look);
}

void setLight(View& view, Triple direction, bool inWorld) {
    vcp_look look = view.look();
    for (size_t i = 0; i < direction.size(); ++i) look.light[i] = float(direction[i]);
    look.light_in_world = inWorld ? 1 : 0;
    view.setLook(look);
}

void setSamples(View& view, uint32_t samples) {
    vcp_look look = view.look();
    look.samples = samples;
    view.setLook(look);
}

void bindPictures(py::class_<View>& view) {
    using namespace py::literals;
    view.def("resize", &View::resize, "width"_a, "height"_a)
        .def("settle", &View::settle, "seconds"_a = 60.0, py::call_guard<py::gil_scoped_release>(),
             "Loads and draws all that the view wants; False where the time was over.")
        .def("render", frameOf,
             "The last picture: RGBA of shape (height, width, 4), depth of shape (height, width), infinite where "
             "nothing is.")
        .def("save_png", &View::savePng, "path"_a, "Writes the last picture.")
        .def("pick", pickOf, "x"_a, "y"_a, "What is at a pixel, on the finest level; None where nothing is.");
}

void bindInput(py::class_<View>& view) {
    using namespace py::literals;
    view.def("press", &View::press, "button"_a, "x"_a, "y"_a, "modifiers"_a = 0)
        .def("move", &View::move, "x"_a, "y"_a)
        .def("release", &View::release, "button"_a)
        .def("scroll", &View::scroll, "x"_a, "y"_a, "notches"_a, "modifiers"_a = 0)
        .def(
            "key", [](View& self, char32_t character, bool pressed) { self.key(uint32_t(character), pressed); },
            "character"_a, "pressed"_a = true, "A key, as the character on it in capitals.")
        .def("act", &View::act, "action"_a, "FIT, TOP, ...");
}

void bindLook(py::class_<View>& view) {
    using namespace py::literals;
    view.def(
            "set_camera", [](View& self, const py::kwargs& fields) { self.setCamera(changed(self.camera(), fields)); },
            "position, target, up, fov_y, orthographic.")
        .def("set_look", setLook, "What `look` has, by name; the rest stays.")
        .def("set_light", setLight, "direction"_a, "in_world"_a = false,
             "Towards the light: right, up, back of the camera, or x, y, z of the world.")
        .def("set_sections", py::overload_cast<View&, const std::vector<Plane>&, const py::object&>(setSections),
             "planes"_a, "caps"_a = false, "Keeps what has a x + b y + c z >= d of each plane (a, b, c, d).")
        .def("set_lines", setLines, "lines"_a,
             "Paints lines over pictures: [(points, (r, g, b, opacity), width), ...].")
        .def(
            "set_environment",
            [](View& self, const std::optional<std::string>& source, float turn, float strength) {
                self.setEnvironment(source ? source->c_str() : nullptr, turn, strength);
            },
            py::call_guard<py::gil_scoped_release>(), "source"_a, "turn_degrees"_a = 0.0f, "strength"_a = 1.0f,
            "Lights the view by surroundings: studio, overcast, clear, or a picture (.hdr, .exr); None: by its lights.")
        .def("set_visible", &View::setVisible, "dataset"_a, "visible"_a)
        .def("is_visible", &View::isVisible, "dataset"_a)
        .def_property(
            "samples", [](const View& self) { return self.look().samples; }, setSamples,
            "Rays a pixel of a picture that is settled, 1 to 64: smooth edges.")
        .def_property_readonly("look", [](const View& self) { return toDict(self.look()); })
        .def_property_readonly("camera", [](const View& self) { return toDict(self.camera()); });
}

void bindContext(py::class_<View>& view) {
    using namespace py::literals;
    view.def(
            "set_budgets",
            [](View& self, uint64_t gpu, uint64_t ram) { Context(opened(self).context()).setBudgets(gpu, ram); },
            "gpu_bytes"_a, "ram_bytes"_a = 0)
        .def_property_readonly("stats", [](const View& self) { return toDict(self.stats()); })
        .def_property_readonly("dataset", [](View& self) { return datasetOf(opened(self)); })
        .def_property_readonly("device", [](View& self) { return std::string(opened(self).context().device().name); })
        .def("close", close, "Gives back what the view has; calls for it are errors from then on.")
        .def("__enter__", opened, py::return_value_policy::reference)
        .def("__exit__", [](View& self, const py::args&) { close(self); });
}

}  // namespace

PYBIND11_MODULE(_vcp, module) {
    using namespace py::literals;
    module.doc() = "Views of .vcp files, and how to build them.";
    module.attr("__version__") = vcp_version();
    py::register_exception<Error>(module, "Error", PyExc_RuntimeError);
    module.def("build", buildWith, "inputs"_a, "output"_a, "cell"_a = 0.0, "error"_a = 0.0, "memory_bytes"_a = 0,
               "threads"_a = 0, "colour"_a = "auto", "format"_a = "", "progress"_a = py::none(),
               "Meshes to one .vcp file. progress(stage, fraction) returns False to cancel.");
    module.def("open", openView, "path"_a, "width"_a = 1280, "height"_a = 720, "gpu_bytes"_a = 0, "device"_a = "",
               "z_is_up"_a = false, "progress"_a = py::none(),
               "A view of a .vcp file or its http(s) address, of a scene file (.json), or of several: [(path, matrix), "
               "...], the matrix 16 numbers row by row, or None. progress(opened, datasets) returns False to cancel.");
    py::class_<View> view(module, "View");
    bindPictures(view);
    bindInput(view);
    bindLook(view);
    bindContext(view);
    for (const auto& [name, number] : {std::pair{"FIT", int(VCP_FIT)},
                                       {"RESET", int(VCP_RESET)},
                                       {"FRONT", int(VCP_VIEW_FRONT)},
                                       {"RIGHT", int(VCP_VIEW_RIGHT)},
                                       {"TOP", int(VCP_VIEW_TOP)},
                                       {"ISOMETRIC", int(VCP_VIEW_ISOMETRIC)},
                                       {"NEXT_SHADING", int(VCP_NEXT_SHADING)},
                                       {"LEFT_BUTTON", int(VCP_LEFT)},
                                       {"MIDDLE_BUTTON", int(VCP_MIDDLE)},
                                       {"RIGHT_BUTTON", int(VCP_RIGHT)},
                                       {"SHIFT", int(VCP_SHIFT)},
                                       {"CONTROL", int(VCP_CONTROL)}})
        module.attr(name) = number;
}
