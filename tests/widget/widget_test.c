/* The widget from plain C: test_widget CASE FOLDER. Exit status 0 done, 1 failed, 77 no Vulkan device. */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "vcp.h"

#define CHECK(condition)                                            \
    do {                                                            \
        if (!(condition)) {                                         \
            fprintf(stderr, "line %d: %s\n", __LINE__, #condition); \
            exit(1);                                                \
        }                                                           \
    } while (0)
#define OK(call) check_ok(call, #call, __LINE__)

enum { WIDTH = 96, HEIGHT = 64, PIXELS = WIDTH * HEIGHT };

static char ply[4096], tree[4096], scene[4096];

static void check_ok(vcp_status status, const char* call, int line) {
    if (status == VCP_OK) return;
    fprintf(stderr, "line %d: %s: %s\n", line, call, vcp_status_text(status));
    exit(1);
}

/* A ball of radius 1 about (x, 0, 0). */
static void write_ball(double x) {
    enum { RINGS = 24, SECTORS = 48 };
    const double pi = 3.14159265358979323846;
    FILE* file = fopen(ply, "w");
    CHECK(file);
    fprintf(file, "ply\nformat ascii 1.0\nelement vertex %d\nproperty double x\nproperty double y\nproperty double z\n",
            (RINGS + 1) * SECTORS);
    fprintf(file, "element face %d\nproperty list uchar int vertex_indices\nend_header\n", 2 * RINGS * SECTORS);
    for (int i = 0; i <= RINGS; ++i)
        for (int j = 0; j < SECTORS; ++j) {
            const double a = pi * i / RINGS, b = 2 * pi * j / SECTORS;
            fprintf(file, "%.17g %.17g %.17g\n", x + sin(a) * cos(b), cos(a), sin(a) * sin(b));
        }
    for (int i = 0; i < RINGS; ++i)
        for (int j = 0; j < SECTORS; ++j) {
            const int p = i * SECTORS + j, q = i * SECTORS + (j + 1) % SECTORS;
            fprintf(file, "3 %d %d %d\n3 %d %d %d\n", p, q, p + SECTORS, q, q + SECTORS, p + SECTORS);
        }
    CHECK(fclose(file) == 0);
}

static void build_ball(double x) {
    write_ball(x);
    const char* inputs[] = {ply};
    char text[256] = "";
    vcp_build_options options = VCP_INIT(vcp_build_options);
    options.inputs = inputs;
    options.input_count = 1;
    options.output = tree;
    options.error_text = text;
    options.error_text_size = sizeof(text);
    vcp_build_report report = VCP_INIT(vcp_build_report);
    if (vcp_build(&options, &report) != VCP_OK) {
        fprintf(stderr, "%s\n", text);
        exit(1);
    }
    CHECK(report.triangles == 2 * 24 * 48 && report.levels >= 1 && report.file_bytes > 4096);
}

static vcp_context* make_context(const vcp_context_options* options) {
    vcp_context* context = NULL;
    OK(vcp_context_create(options, &context));
    return context;
}

static vcp_view* make_view(vcp_context* context) {
    vcp_view_options options = VCP_INIT(vcp_view_options);
    options.width = WIDTH;
    options.height = HEIGHT;
    vcp_view* view = NULL;
    OK(vcp_view_create(context, &options, &view));
    return view;
}

static void read_frame(vcp_view* view, uint8_t* rgba, float* depth) {
    vcp_frame frame = VCP_INIT(vcp_frame);
    frame.rgba = rgba;
    frame.rgba_size = 4 * PIXELS;
    frame.depth = depth;
    frame.depth_size = PIXELS;
    OK(vcp_view_read(view, &frame));
    CHECK(frame.width == WIDTH && frame.height == HEIGHT);
}

/* Colour, depth and pick of one view agree, and with the ball. */
static void picture(void) {
    build_ball(1e6);
    vcp_context* context = make_context(NULL);
    vcp_view* view = make_view(context);
    OK(vcp_context_open(context, tree, NULL));
    OK(vcp_view_settle(view, 60));
    static uint8_t rgba[4 * PIXELS];
    static float depth[PIXELS];
    read_frame(view, rgba, depth);
    vcp_stats stats = VCP_INIT(vcp_stats);
    OK(vcp_view_stats(view, &stats));
    uint64_t hits = 0;
    for (int i = 0; i < PIXELS; ++i) hits += isfinite(depth[i]) ? 1 : 0;
    CHECK(hits > 500 && hits == stats.hit_pixels && stats.rays == PIXELS && stats.settled && stats.frames == 16 &&
          stats.samples == 16 && stats.frame_ms > 0);
    CHECK(isinf(depth[0]) && memcmp(rgba, rgba + 4 * (PIXELS / 2 + WIDTH / 2), 4) != 0 && rgba[3] == 255);

    vcp_camera camera = VCP_INIT(vcp_camera);
    OK(vcp_view_get_camera(view, &camera));
    vcp_pick pick = VCP_INIT(vcp_pick);
    OK(vcp_view_pick(view, WIDTH / 2 + 0.5, HEIGHT / 2 + 0.5, &pick));
    vcp_dataset_info info = VCP_INIT(vcp_dataset_info);
    OK(vcp_context_dataset(context, &info));
    CHECK(pick.hit && fabs(pick.distance - depth[PIXELS / 2 + WIDTH / 2]) < 1e-4);
    const double* p = pick.position;
    const double radius = sqrt((p[0] - 1e6) * (p[0] - 1e6) + p[1] * p[1] + p[2] * p[2]);
    CHECK(fabs(radius - 1) < 0.01 && pick.error > 0 && pick.error <= info.certified_error &&
          pick.level == info.levels - 1);
    CHECK(fabs(pick.normal[2]) > 0.99 && camera.position[2] * pick.normal[2] > 0);
    OK(vcp_view_pick(view, 0, 0, &pick));
    CHECK(!pick.hit);
    OK(vcp_view_pick(view, -1, 1e9, &pick));
    CHECK(!pick.hit);

    /* Nothing changed: nothing is drawn. Something did: it is. */
    vcp_step step = VCP_INIT(vcp_step);
    OK(vcp_view_update(view, &step));
    CHECK(!step.draw && step.settled && isinf(step.wait_seconds));
    vcp_look look = VCP_INIT(vcp_look);
    OK(vcp_view_get_look(view, &look));
    CHECK(look.samples == 16);
    look.samples = 65;
    CHECK(vcp_view_set_look(view, &look) == VCP_USAGE);
    /* One more sample is drawn where one more is wanted; fewer are not fewer than there are. */
    look.samples = 17;
    OK(vcp_view_set_look(view, &look));
    OK(vcp_view_settle(view, 60));
    OK(vcp_view_stats(view, &stats));
    CHECK(stats.frames == 17 && stats.samples == 17);
    look.samples = 1;
    OK(vcp_view_set_look(view, &look));
    OK(vcp_view_update(view, &step));
    CHECK(!step.draw);
    /* Where the background is transparent, edges are between. */
    look.samples = 4;
    look.transparent = 1;
    OK(vcp_view_set_look(view, &look));
    OK(vcp_view_settle(view, 60));
    read_frame(view, rgba, depth);
    int partly = 0;
    for (int i = 0; i < PIXELS; ++i) partly += rgba[4 * i + 3] > 0 && rgba[4 * i + 3] < 255 ? 1 : 0;
    CHECK(partly > 20);
    look.transparent = 0;
    look.shading = VCP_SHADING_NORMALS;
    look.section_count = 1;
    look.sections[0][0] = 1;
    look.sections[0][3] = 1e6;
    OK(vcp_view_set_look(view, &look));
    OK(vcp_view_update(view, &step));
    CHECK(step.draw);
    OK(vcp_view_settle(view, 60));
    static uint8_t cut[4 * PIXELS];
    read_frame(view, cut, depth);
    CHECK(memcmp(cut, rgba, sizeof(cut)) != 0);
    OK(vcp_view_destroy(view));
    OK(vcp_context_destroy(context));
}

/* The host's hands: mouse, keys, camera. */
static void input(void) {
    build_ball(0);
    vcp_context* context = make_context(NULL);
    OK(vcp_context_open(context, tree, NULL));
    vcp_view* view = make_view(context);
    OK(vcp_view_settle(view, 60));
    vcp_camera before = VCP_INIT(vcp_camera), after = VCP_INIT(vcp_camera);
    OK(vcp_view_get_camera(view, &before));
    OK(vcp_view_mouse_press(view, VCP_LEFT, 40, 30, 0));
    OK(vcp_view_mouse_move(view, 60, 35));
    OK(vcp_view_mouse_release(view, VCP_LEFT));
    OK(vcp_view_get_camera(view, &after));
    CHECK(memcmp(before.position, after.position, sizeof(before.position)) != 0);
    OK(vcp_view_mouse_move(view, 10, 10));
    OK(vcp_view_get_camera(view, &before));
    CHECK(memcmp(&before, &after, sizeof(before)) == 0);
    OK(vcp_view_mouse_scroll(view, 48, 32, 2, 0));
    OK(vcp_view_get_camera(view, &after));
    CHECK(memcmp(before.position, after.position, sizeof(before.position)) != 0);
    OK(vcp_view_key(view, 'P', 1));
    OK(vcp_view_get_camera(view, &after));
    CHECK(after.orthographic);
    OK(vcp_view_act(view, VCP_RESET));
    vcp_camera wanted = VCP_INIT(vcp_camera);
    wanted.position[2] = 5;
    OK(vcp_view_set_camera(view, &wanted));
    OK(vcp_view_get_camera(view, &after));
    CHECK(after.position[2] == 5 && fabs(after.target[2]) < 1e-12 && after.up[1] > 0.999 &&
          fabs(after.fov_y - 0.785398) < 1e-5 && !after.orthographic);
    OK(vcp_view_resize(view, 32, 16));
    OK(vcp_view_settle(view, 60));
    vcp_frame frame = VCP_INIT(vcp_frame);
    OK(vcp_view_read(view, &frame));
    CHECK(frame.width == 32 && frame.height == 16);
    OK(vcp_view_resize(view, 0, 0));
    OK(vcp_view_settle(view, 60));
    OK(vcp_view_destroy(view));
    OK(vcp_context_destroy(context));
}

/* What callbacks were told, and by what they were answered. */
typedef struct told {
    int logs, errors, redraws, settled, progress, cancel_at;
    int stages, is_over; /* of a build */
    char stage[16][32];
    double fraction;
    vcp_status last_error, answer;
    vcp_context* context;
} told;

static void on_log(void* user, vcp_log_level level, const char* text) {
    CHECK(level <= VCP_LOG_ERROR && text[0]);
    ++((told*)user)->logs;
}
static void on_error(void* user, vcp_status status, const char* text) {
    CHECK(text[0]);
    ((told*)user)->last_error = status;
    ++((told*)user)->errors;
}
static void on_redraw(void* user, vcp_view* view) {
    CHECK(view);
    ++((told*)user)->redraws;
}
static void on_settled(void* user, vcp_view* view) {
    told* t = user;
    ++t->settled;
    t->answer = vcp_view_render(view);
    CHECK(vcp_context_destroy(t->context) == VCP_BUSY && vcp_view_destroy(view) == VCP_BUSY);
}
static int on_progress(void* user, const vcp_progress* progress) {
    told* t = user;
    CHECK(!t->is_over && progress->stage && strlen(progress->stage) < sizeof(t->stage[0]));
    CHECK(progress->fraction >= t->fraction && progress->fraction <= 1);
    t->fraction = progress->fraction;
    if (t->stages == 0 || strcmp(t->stage[t->stages - 1], progress->stage) != 0) {
        CHECK(t->stages < 16);
        strcpy(t->stage[t->stages++], progress->stage);
    }
    t->is_over = ++t->progress == t->cancel_at;
    return !t->is_over;
}

/* Every stage is told whole and in order, and nothing when the build is over or was cancelled. */
static void progress(void) {
    write_ball(0);
    const char* inputs[] = {ply};
    vcp_build_options build = VCP_INIT(vcp_build_options);
    vcp_build_report report = VCP_INIT(vcp_build_report);
    told t = {0};
    build.inputs = inputs;
    build.input_count = 1;
    build.output = tree;
    build.cell = 0.01;
    build.progress = on_progress;
    build.user = &t;
    OK(vcp_build(&build, &report));
    t.is_over = 1;
    CHECK(t.fraction == 1 && report.levels >= 2 && t.stages == 4 + (int)report.levels);
    CHECK(strcmp(t.stage[0], "reading") == 0 && strcmp(t.stage[1], "sorting") == 0);
    for (int i = 1; i <= (int)report.levels; ++i) {
        char wanted[32];
        snprintf(wanted, sizeof(wanted), "level %d of %d", i, (int)report.levels);
        CHECK(strcmp(t.stage[1 + i], wanted) == 0);
    }
    CHECK(strcmp(t.stage[t.stages - 2], "writing") == 0 && strcmp(t.stage[t.stages - 1], "done") == 0);

    /* Cancelled at each of the first calls. */
    build.cell = 0.005;
    for (int at = 1; at <= 2; ++at) {
        told none = {0};
        none.cancel_at = at;
        build.user = &none;
        CHECK(vcp_build(&build, NULL) == VCP_CANCELLED && none.progress == at);
    }
}

static void callbacks(void) {
    build_ball(0);
    told t = {0};
    vcp_callbacks call = VCP_INIT(vcp_callbacks);
    call.user = &t;
    call.log = on_log;
    call.error = on_error;
    call.needs_redraw = on_redraw;
    call.settled = on_settled;
    vcp_context_options options = VCP_INIT(vcp_context_options);
    options.callbacks = &call;
    t.context = make_context(&options);
    CHECK(t.logs == 1);
    vcp_view* view = make_view(t.context);
    OK(vcp_context_open(t.context, tree, NULL));
    CHECK(t.logs == 2 && t.redraws == 1);
    OK(vcp_view_settle(view, 60));
    CHECK(t.settled == 1 && t.answer == VCP_BUSY);
    OK(vcp_view_settle(view, 60));
    CHECK(t.settled == 1);
    OK(vcp_view_key(view, 'M', 1));
    CHECK(t.redraws == 2 && t.errors == 0);
    CHECK(vcp_context_open(t.context, "/nowhere/at.vcp", NULL) == VCP_IO && t.errors == 1 && t.last_error == VCP_IO);
    CHECK(strstr(vcp_context_last_error(t.context), "/nowhere/at.vcp"));
    OK(vcp_view_destroy(view));
    OK(vcp_context_destroy(t.context));
}

/* Wrong calls give errors, and change nothing. */
static void wrong_calls(void) {
    build_ball(0);
    vcp_context* context = NULL;
    vcp_view* view = NULL;
    vcp_step step = VCP_INIT(vcp_step);
    char text[64] = "";
    CHECK(vcp_context_create(NULL, NULL) == VCP_USAGE);
    vcp_context_options options = VCP_INIT(vcp_context_options);
    options.struct_size = 0;
    CHECK(vcp_context_create(&options, &context) == VCP_USAGE && !context);
    options.struct_size = sizeof(options);
    options.device = "no such device";
    options.error_text = text;
    options.error_text_size = sizeof(text);
    CHECK(vcp_context_create(&options, &context) == VCP_DEVICE && !context && strstr(text, "no such device"));
    options.device = NULL;
    options.gpu_bytes = 1;
    CHECK(vcp_context_create(&options, &context) == VCP_USAGE);
    vcp_host_device nothing = VCP_INIT(vcp_host_device);
    options.gpu_bytes = 0;
    options.host_device = &nothing;
    CHECK(vcp_context_create(&options, &context) == VCP_USAGE);

    /* A struct of a later version: what is zero is no matter, what is not is refused. */
    struct {
        vcp_context_options known;
        uint64_t later;
    } large = {{.struct_size = sizeof(large)}, 1};
    CHECK(vcp_context_create(&large.known, &context) == VCP_USAGE);
    large.later = 0;
    OK(vcp_context_create(&large.known, &context));

    CHECK(vcp_context_open(NULL, tree, NULL) == VCP_USAGE && vcp_context_open(context, NULL, NULL) == VCP_USAGE);
    CHECK(vcp_context_open(context, ply, NULL) == VCP_INVALID_INPUT);
    CHECK(strstr(vcp_context_last_error(context), ply));
    vcp_dataset_info info = VCP_INIT(vcp_dataset_info);
    CHECK(vcp_context_dataset(context, &info) == VCP_USAGE && vcp_context_dataset(context, NULL) == VCP_USAGE);
    CHECK(vcp_context_wait(context, -1) == VCP_USAGE && vcp_context_wait(context, NAN) == VCP_USAGE);
    CHECK(vcp_context_set_budgets(context, 1, 0) == VCP_USAGE);

    vcp_view_options window = VCP_INIT(vcp_view_options);
    CHECK(vcp_view_create(context, NULL, NULL) == VCP_USAGE && vcp_view_create(NULL, NULL, &view) == VCP_USAGE);
    window.width = 1000000;
    CHECK(vcp_view_create(context, &window, &view) == VCP_USAGE && !view);
    window.width = 0;
    window.window_system = 99;
    CHECK(vcp_view_create(context, &window, &view) == VCP_USAGE);
    window.window_system = VCP_WINDOW_XCB;
    CHECK(vcp_view_create(context, &window, &view) == VCP_USAGE);
    window.display = &window;
    window.window = 1;
    CHECK(vcp_view_create(context, &window, &view) == VCP_USAGE &&
          strstr(vcp_context_last_error(context), "without windows"));

    view = make_view(context);
    CHECK(vcp_context_destroy(context) == VCP_USAGE);
    vcp_frame frame = VCP_INIT(vcp_frame);
    CHECK(vcp_view_read(view, &frame) == VCP_USAGE);
    vcp_pick pick = VCP_INIT(vcp_pick);
    CHECK(vcp_view_pick(view, 1, 1, &pick) == VCP_USAGE);
    OK(vcp_context_open(context, tree, NULL));
    CHECK(vcp_view_settle(view, NAN) == VCP_USAGE);
    OK(vcp_view_settle(view, 60));
    CHECK(vcp_view_update(view, NULL) == VCP_USAGE && vcp_view_update(NULL, &step) == VCP_USAGE);
    CHECK(vcp_view_pick(view, 1, 1, NULL) == VCP_USAGE);
    uint8_t pixel[4];
    frame.rgba = pixel;
    frame.rgba_size = 4;
    CHECK(vcp_view_read(view, &frame) == VCP_LIMIT && frame.width == WIDTH && frame.height == HEIGHT);
    vcp_host_image image = VCP_INIT(vcp_host_image);
    CHECK(vcp_view_copy_to_image(view, NULL) == VCP_USAGE && vcp_view_copy_to_image(view, &image) == VCP_USAGE);
    CHECK(vcp_view_resize(view, 16385, 1) == VCP_USAGE);
    CHECK(vcp_view_mouse_press(view, 17, 1, 1, 0) == VCP_USAGE &&
          vcp_view_mouse_press(view, VCP_LEFT, NAN, 1, 0) == VCP_USAGE);
    CHECK(vcp_view_mouse_move(view, INFINITY, 0) == VCP_USAGE && vcp_view_mouse_release(view, -1) == VCP_USAGE);
    CHECK(vcp_view_mouse_scroll(view, 1, 1, NAN, 0) == VCP_USAGE && vcp_view_act(view, 999) == VCP_USAGE &&
          vcp_view_act(view, -1) == VCP_USAGE);
    OK(vcp_view_key(view, 0xffffffffu, 1));
    vcp_camera camera = VCP_INIT(vcp_camera);
    CHECK(vcp_view_set_camera(view, &camera) == VCP_USAGE && vcp_view_set_camera(view, NULL) == VCP_USAGE);
    camera.target[0] = NAN;
    CHECK(vcp_view_move_camera(view, &camera) == VCP_USAGE);
    camera.target[0] = 0;
    camera.target[1] = camera.up[1] = 1;
    CHECK(vcp_view_set_camera(view, &camera) == VCP_USAGE);
    vcp_look look = VCP_INIT(vcp_look);
    CHECK(vcp_view_set_look(view, NULL) == VCP_USAGE);
    OK(vcp_view_get_look(view, &look));
    look.error_pixels = -1;
    CHECK(vcp_view_set_look(view, &look) == VCP_USAGE);
    look.error_pixels = 1;
    look.colour_error = -1;
    CHECK(vcp_view_set_look(view, &look) == VCP_USAGE);
    look.colour_error = 1;
    look.section_count = 7;
    CHECK(vcp_view_set_look(view, &look) == VCP_USAGE);
    look.section_count = 1;
    CHECK(vcp_view_set_look(view, &look) == VCP_USAGE);
    look.section_count = 0;
    look.shading = -1;
    CHECK(vcp_view_set_look(view, &look) == VCP_USAGE);
    vcp_line line = VCP_INIT(vcp_line);
    line.point_count = 2;
    CHECK(vcp_view_set_lines(view, NULL, 1) == VCP_USAGE && vcp_view_set_lines(view, &line, 1) == VCP_USAGE);
    static const double points[6] = {0, 0, 0, 1, NAN, 1};
    line.points = points;
    CHECK(vcp_view_set_lines(view, &line, 1) == VCP_USAGE && strstr(vcp_view_last_error(view), "line 0"));
    line.point_count = 1;
    line.width = -1;
    CHECK(vcp_view_set_lines(view, &line, 1) == VCP_USAGE);
    uint32_t visible = 0;
    CHECK(vcp_view_set_visible(view, 7, 0) == VCP_USAGE && vcp_view_is_visible(view, 7, &visible) == VCP_USAGE);
    CHECK(vcp_view_set_environment(view, "none.hdr", 0, 1) == VCP_IO && strstr(vcp_view_last_error(view), "none.hdr"));
    CHECK(vcp_view_set_environment(view, "studio", NAN, 1) == VCP_USAGE &&
          vcp_view_set_environment(view, "studio", 0, 11) == VCP_USAGE);
    CHECK(vcp_view_save_png(view, NULL) == VCP_USAGE && vcp_view_save_png(view, "-") == VCP_USAGE);
    CHECK(vcp_context_start_open(context, NULL, NULL) == VCP_USAGE &&
          vcp_context_start_open_placed(context, NULL, 1, NULL) == VCP_USAGE &&
          vcp_context_opening(context, NULL) == VCP_USAGE);
    OK(vcp_context_cancel_opening(context));
    OK(vcp_view_update(view, &step));
    CHECK(!step.draw);
    OK(vcp_view_destroy(view));
    OK(vcp_context_destroy(context));
    OK(vcp_view_destroy(NULL));
    OK(vcp_context_destroy(NULL));

    vcp_build_options build = VCP_INIT(vcp_build_options);
    CHECK(vcp_build(NULL, NULL) == VCP_USAGE && vcp_build(&build, NULL) == VCP_USAGE);
    const char* inputs[] = {"/nowhere.ply", NULL};
    build.inputs = inputs;
    build.input_count = 2;
    build.output = tree;
    CHECK(vcp_build(&build, NULL) == VCP_USAGE);
    build.input_count = 1;
    CHECK(vcp_build(&build, NULL) == VCP_IO);
    /* Texts are UTF-8, whatever a file is called and wherever they are cut off. */
    inputs[0] = "/nowhere/\xff\xc3\xa9.ply";
    build.error_text = text;
    build.error_text_size = sizeof(text);
    CHECK(vcp_build(&build, NULL) == VCP_IO && strstr(text, "/nowhere/\xef\xbf\xbd\xc3\xa9.ply"));
    build.error_text_size = 14;
    CHECK(vcp_build(&build, NULL) == VCP_IO && strcmp(text, "/nowhere/\xef\xbf\xbd") == 0);
    CHECK(vcp_context_create(NULL, &context) == VCP_OK &&
          vcp_context_open(context, "/nowhere/\xe9.vcp", NULL) == VCP_IO);
    CHECK(strstr(vcp_context_last_error(context), "/nowhere/\xef\xbf\xbd.vcp"));
    OK(vcp_context_destroy(context));
    CHECK(vcp_version()[0] && vcp_status_text(-5)[0] && vcp_context_last_error(NULL)[0] &&
          vcp_view_last_error(NULL)[0]);
}

/* Views of one context share its budget, and what one loads the other has. */
static void sharing(void) {
    build_ball(0);
    vcp_context_options options = VCP_INIT(vcp_context_options);
    options.gpu_bytes = 8 << 20;
    vcp_context* context = make_context(&options);
    vcp_view* first = make_view(context);
    vcp_view* second = make_view(context);
    OK(vcp_context_open(context, tree, NULL));
    OK(vcp_view_settle(first, 60));
    vcp_stats stats = VCP_INIT(vcp_stats), again = VCP_INIT(vcp_stats);
    OK(vcp_view_stats(first, &stats));
    OK(vcp_view_settle(second, 60));
    OK(vcp_view_stats(second, &again));
    CHECK(stats.bytes_read > 0 && again.bytes_read == stats.bytes_read && again.pool_bytes == stats.pool_bytes &&
          stats.pool_bytes <= options.gpu_bytes);
    static uint8_t a[4 * PIXELS], b[4 * PIXELS];
    static float depth[PIXELS];
    read_frame(first, a, depth);
    read_frame(second, b, depth);
    CHECK(memcmp(a, b, sizeof(a)) == 0);
    OK(vcp_context_set_budgets(context, 4 << 20, 0));
    OK(vcp_view_destroy(first));
    OK(vcp_view_settle(second, 60));
    OK(vcp_view_stats(second, &again));
    CHECK(again.resident_bytes <= 4 << 20);
    read_frame(second, b, depth);
    CHECK(memcmp(a, b, sizeof(a)) == 0);
    OK(vcp_view_destroy(second));
    OK(vcp_context_destroy(context));
}

/* Where no device is named, the processor casts the rays of a software device; where that is named, its shaders do. */
static void device_rays(void) {
    build_ball(0);
    vcp_device_info device = VCP_INIT(vcp_device_info);
    static float depth[2][PIXELS];
    static uint8_t rgba[4 * PIXELS];
    for (int named = 0; named < 2; ++named) {
        vcp_context_options options = VCP_INIT(vcp_context_options);
        if (named) options.device = device.name;
        vcp_context* context = make_context(&options);
        vcp_view* view = make_view(context);
        if (!named) OK(vcp_context_device(context, &device));
        OK(vcp_context_open(context, tree, NULL));
        OK(vcp_view_settle(view, 60));
        vcp_stats stats = VCP_INIT(vcp_stats);
        OK(vcp_view_stats(view, &stats));
        CHECK(stats.processor_rays == (device.software && !named));
        read_frame(view, rgba, depth[named]);
        OK(vcp_view_destroy(view));
        OK(vcp_context_destroy(context));
    }
    int apart = 0;
    for (int i = 0; i < PIXELS; ++i)
        apart += isinf(depth[0][i]) ? !isinf(depth[1][i]) : !(fabsf(depth[0][i] - depth[1][i]) < 1e-4f);
    CHECK(apart <= 2);
}

static void write_scene(const char* text) {
    FILE* file = fopen(scene, "w");
    CHECK(file && fputs(text, file) >= 0 && fclose(file) == 0);
}

static void look_from(vcp_view* view, double x) {
    vcp_camera camera = VCP_INIT(vcp_camera);
    camera.position[0] = camera.target[0] = x;
    camera.position[2] = 5;
    OK(vcp_view_set_camera(view, &camera));
}

/* Two balls: one where it lies, one half as large, 3 to the right of it. */
static void open_two(vcp_context* context) {
    vcp_placed two[2] = {VCP_INIT(vcp_placed), VCP_INIT(vcp_placed)};
    two[0].path = two[1].path = tree;
    two[1].world_from_dataset[0] = two[1].world_from_dataset[5] = two[1].world_from_dataset[10] = 0.5;
    two[1].world_from_dataset[3] = 3;
    two[1].world_from_dataset[15] = 1;
    OK(vcp_context_open_placed(context, two, 2, NULL));
}

static void placed(void) {
    build_ball(0);
    vcp_context* context = make_context(NULL);
    vcp_view* view = make_view(context);
    OK(vcp_context_open(context, tree, NULL));
    vcp_dataset_info one = VCP_INIT(vcp_dataset_info), info = VCP_INIT(vcp_dataset_info);
    OK(vcp_context_dataset(context, &one));
    CHECK(one.datasets == 1);
    open_two(context);
    OK(vcp_context_dataset(context, &info));
    CHECK(info.datasets == 2 && info.triangles == 2 * one.triangles && info.levels == one.levels &&
          info.certified_error == one.certified_error);
    CHECK(fabs(info.cell - 0.5 * one.cell) < 1e-12);
    CHECK(fabs(info.bounds_min[0] - one.bounds_min[0]) < 1e-12 &&
          fabs(info.bounds_max[0] - 3 - 0.5 * one.bounds_max[0]) < 1e-12);
    /* All of both is in the picture. */
    OK(vcp_view_settle(view, 60));
    static float depth[PIXELS];
    static uint8_t rgba[4 * PIXELS];
    read_frame(view, rgba, depth);
    CHECK(isfinite(depth[PIXELS / 2 + WIDTH / 4]) && isfinite(depth[PIXELS / 2 + WIDTH * 8 / 10]) && isinf(depth[0]));
    vcp_pick pick = VCP_INIT(vcp_pick);
    for (uint32_t i = 0; i < 2; ++i) {
        look_from(view, 3.0 * i);
        OK(vcp_view_pick(view, WIDTH / 2, HEIGHT / 2, &pick));
        CHECK(pick.hit && pick.dataset == i && fabs(pick.position[0] - 3.0 * i) < 0.01 &&
              fabs(pick.position[2] - (i ? 0.5 : 1)) < 0.01);
        CHECK(fabs(pick.error - (i ? 0.5 : 1) * one.certified_error) < 1e-12 &&
              fabs(pick.distance - (i ? 4.5 : 4)) < 0.01);
    }

    /* Wrong ones change nothing. */
    vcp_placed wrong[2] = {VCP_INIT(vcp_placed), VCP_INIT(vcp_placed)};
    wrong[0].path = wrong[1].path = tree;
    CHECK(vcp_context_open_placed(context, NULL, 1, NULL) == VCP_USAGE &&
          vcp_context_open_placed(NULL, wrong, 2, NULL) == VCP_USAGE);
    CHECK(vcp_context_open_placed(context, wrong, 0, NULL) == VCP_USAGE &&
          vcp_context_open_placed(context, wrong, 257, NULL) == VCP_USAGE);
    for (int i = 0; i < 16; ++i) wrong[1].world_from_dataset[i] = i % 5 ? 0 : 1;
    wrong[1].world_from_dataset[0] = -1;
    CHECK(vcp_context_open_placed(context, wrong, 2, NULL) == VCP_USAGE &&
          strstr(vcp_context_last_error(context), "dataset 1") && strstr(vcp_context_last_error(context), "mirrors"));
    wrong[1].world_from_dataset[0] = NAN;
    CHECK(vcp_context_open_placed(context, wrong, 2, NULL) == VCP_USAGE);
    wrong[1].world_from_dataset[0] = 1;
    wrong[1].world_from_dataset[3] = 1e13;
    CHECK(vcp_context_open_placed(context, wrong, 2, NULL) == VCP_USAGE);
    wrong[1].world_from_dataset[3] = 0;
    wrong[1].struct_size = 8;
    CHECK(vcp_context_open_placed(context, wrong, 2, NULL) == VCP_USAGE);
    wrong[1].struct_size = sizeof(wrong[1]);
    wrong[1].path = NULL;
    CHECK(vcp_context_open_placed(context, wrong, 2, NULL) == VCP_USAGE);
    wrong[1].path = "/nowhere/at.vcp";
    CHECK(vcp_context_open_placed(context, wrong, 2, NULL) == VCP_IO &&
          strstr(vcp_context_last_error(context), "/nowhere/at.vcp"));
    OK(vcp_context_dataset(context, &info));
    CHECK(info.datasets == 2);
    OK(vcp_view_destroy(view));
    OK(vcp_context_destroy(context));
}

/* A look of VCP_INIT is the usual one; what is not zero in it is as it says. */
static void looks(void) {
    build_ball(0);
    vcp_context* context = make_context(NULL);
    vcp_view* view = make_view(context);
    OK(vcp_context_open(context, tree, NULL));
    OK(vcp_view_settle(view, 60));
    static uint8_t usual[4 * PIXELS], now[4 * PIXELS];
    static float depth[PIXELS];
    read_frame(view, usual, depth);
    vcp_look before = VCP_INIT(vcp_look), look = VCP_INIT(vcp_look), after = VCP_INIT(vcp_look);
    OK(vcp_view_get_look(view, &before));
    look.shading = VCP_SHADING_CLAY;
    look.samples = 4;
    look.section_count = 1;
    look.sections[0][0] = 1;
    look.section_caps = 1;
    look.colour_error = 7;
    look.plain = 1;
    OK(vcp_view_set_look(view, &look));
    OK(vcp_view_get_look(view, &after));
    CHECK(after.shading == VCP_SHADING_CLAY && after.samples == 4 && after.section_caps == 1);
    CHECK(after.colour_error == 7 && after.plain == 1 && before.colour_error == 6 && before.plain == 0);
    CHECK(after.error_pixels == before.error_pixels && after.light[1] == before.light[1] &&
          after.background_top[2] == before.background_top[2]);
    /* Seen from the side that is cut away, the cap is at x = 0; without caps the ball's inside is, behind it. */
    vcp_camera camera = VCP_INIT(vcp_camera);
    camera.position[0] = -5;
    OK(vcp_view_set_camera(view, &camera));
    OK(vcp_view_settle(view, 60));
    read_frame(view, now, depth);
    CHECK(fabs(depth[PIXELS / 2 + WIDTH / 2] - 5) < 0.01);
    look.section_caps = 0;
    OK(vcp_view_set_look(view, &look));
    OK(vcp_view_settle(view, 60));
    read_frame(view, now, depth);
    CHECK(fabs(depth[PIXELS / 2 + WIDTH / 2] - 6) < 0.01);
    look = (vcp_look)VCP_INIT(vcp_look);
    OK(vcp_view_set_look(view, &look));
    OK(vcp_view_get_look(view, &after));
    CHECK(memcmp(&after, &before, sizeof(after)) == 0);
    OK(vcp_view_act(view, VCP_RESET));
    OK(vcp_view_settle(view, 60));
    read_frame(view, now, depth);
    CHECK(memcmp(now, usual, sizeof(now)) == 0);
    OK(vcp_view_destroy(view));
    OK(vcp_context_destroy(context));
}

/* Polls until nothing is under way; returns what the last call gave. */
static vcp_status end_of_opening(vcp_context* context, uint32_t* opened) {
    for (;;) {
        vcp_opening state = VCP_INIT(vcp_opening);
        const vcp_status status = vcp_context_opening(context, &state);
        CHECK(state.fraction >= 0 && state.fraction <= 1 && state.opened <= state.datasets);
        if (opened) *opened = state.opened;
        if (!state.under_way) return status;
        CHECK(status == VCP_OK);
        OK(vcp_context_wait(context, 0.05));
    }
}

/* What is opened in the background replaces what is open when it is there, and not before. */
static void opening(void) {
    build_ball(0);
    vcp_context* context = make_context(NULL);
    vcp_view* view = make_view(context);
    OK(end_of_opening(context, NULL));
    OK(vcp_context_start_open(context, tree, NULL));
    vcp_dataset_info info = VCP_INIT(vcp_dataset_info);
    CHECK(vcp_context_dataset(context, &info) == VCP_USAGE);
    uint32_t opened = 0;
    OK(end_of_opening(context, &opened));
    CHECK(opened == 1);
    OK(vcp_context_dataset(context, &info));
    OK(vcp_view_settle(view, 60));
    vcp_stats stats = VCP_INIT(vcp_stats);
    OK(vcp_view_stats(view, &stats));
    CHECK(stats.hit_pixels > 500);

    /* A hundred of them; cancelled, or failing, they leave the one. */
    static vcp_placed many[100];
    for (int i = 0; i < 100; ++i) {
        many[i] = (vcp_placed)VCP_INIT(vcp_placed);
        many[i].path = tree;
    }
    OK(vcp_context_start_open_placed(context, many, 100, NULL));
    OK(vcp_context_cancel_opening(context));
    CHECK(end_of_opening(context, NULL) == VCP_CANCELLED);
    many[99].path = "/nowhere/at.vcp";
    OK(vcp_context_start_open_placed(context, many, 100, NULL));
    CHECK(end_of_opening(context, &opened) == VCP_IO && opened == 99 &&
          strstr(vcp_context_last_error(context), "/nowhere/at.vcp"));
    OK(end_of_opening(context, NULL));
    OK(vcp_context_dataset(context, &info));
    CHECK(info.datasets == 1);

    /* The later one counts; so does a call that waits; and a context may go while something is opened. */
    OK(vcp_context_start_open(context, "/nowhere/at.vcp", NULL));
    OK(vcp_context_start_open_placed(context, many, 2, NULL));
    OK(end_of_opening(context, &opened));
    OK(vcp_context_dataset(context, &info));
    CHECK(info.datasets == 2 && opened == 2);
    OK(vcp_context_start_open_placed(context, many, 99, NULL));
    OK(vcp_context_open(context, tree, NULL));
    OK(end_of_opening(context, NULL));
    OK(vcp_context_dataset(context, &info));
    CHECK(info.datasets == 1);
    OK(vcp_context_start_open_placed(context, many, 99, NULL));
    OK(vcp_view_destroy(view));
    OK(vcp_context_destroy(context));
}

static int is_red(const uint8_t* pixel) { return pixel[0] == 255 && pixel[1] == 0 && pixel[2] == 0; }

/* Datasets are hidden, for a view, without being read again; lines are painted over pictures; pictures become files. */
static void layers(void) {
    build_ball(0);
    vcp_context* context = make_context(NULL);
    vcp_view *view = make_view(context), *other = make_view(context);
    open_two(context);
    OK(vcp_view_settle(view, 60));
    static uint8_t both[4 * PIXELS], rgba[4 * PIXELS];
    static float depth[PIXELS];
    read_frame(view, both, depth);
    vcp_stats stats = VCP_INIT(vcp_stats);
    OK(vcp_view_stats(view, &stats));
    const uint64_t hits = stats.hit_pixels, bytes = stats.bytes_read;
    const int left = PIXELS / 2 + WIDTH / 4, right = PIXELS / 2 + WIDTH * 8 / 10;
    uint32_t visible = 0;
    for (uint32_t hidden = 0; hidden < 2; ++hidden) {
        OK(vcp_view_set_visible(view, hidden, 0));
        OK(vcp_view_is_visible(view, hidden, &visible));
        CHECK(visible == 0);
        OK(vcp_view_settle(view, 60));
        read_frame(view, rgba, depth);
        CHECK(isfinite(depth[hidden ? left : right]) && isinf(depth[hidden ? right : left]));
        vcp_pick pick = VCP_INIT(vcp_pick);
        OK(vcp_view_pick(view, (hidden ? right : left) % WIDTH, HEIGHT / 2, &pick));
        CHECK(!pick.hit);
        OK(vcp_view_pick(view, (hidden ? left : right) % WIDTH, HEIGHT / 2, &pick));
        CHECK(pick.hit && pick.dataset == 1 - hidden);
        OK(vcp_view_settle(other, 60));
        OK(vcp_view_stats(other, &stats));
        CHECK(stats.hit_pixels == hits);
        OK(vcp_view_set_visible(view, hidden, 1));
    }
    OK(vcp_view_set_visible(view, 0, 0));
    OK(vcp_view_set_visible(view, 1, 0));
    OK(vcp_view_settle(view, 60));
    OK(vcp_view_stats(view, &stats));
    CHECK(stats.hit_pixels == 0 && stats.settled);
    CHECK(vcp_view_set_visible(view, 2, 0) == VCP_USAGE);
    OK(vcp_view_set_visible(view, 0, 1));
    OK(vcp_view_set_visible(view, 1, 1));
    OK(vcp_view_settle(view, 60));
    read_frame(view, rgba, depth);
    OK(vcp_view_stats(view, &stats));
    CHECK(memcmp(rgba, both, sizeof(both)) == 0 && stats.bytes_read == bytes);

    /* A line through both, behind their surface: it is seen, and a step draws it. */
    const double points[6] = {-1, 0, 0, 4, 0, 0};
    vcp_line line = VCP_INIT(vcp_line);
    line.points = points;
    line.point_count = 2;
    line.colour[0] = line.colour[3] = 1;
    line.width = 3;
    OK(vcp_view_set_lines(view, &line, 1));
    vcp_step step = VCP_INIT(vcp_step);
    OK(vcp_view_update(view, &step));
    CHECK(step.draw);
    OK(vcp_view_render(view));
    OK(vcp_view_update(view, &step));
    CHECK(!step.draw);
    read_frame(view, rgba, depth);
    CHECK(is_red(rgba + 4 * left) && is_red(rgba + 4 * right) && memcmp(rgba, both, 4 * WIDTH) == 0);
    char path[4200];
    snprintf(path, sizeof(path), "%s.png", tree);
    OK(vcp_view_save_png(view, path));
    FILE* file = fopen(path, "rb");
    unsigned char head[24];
    CHECK(file && fread(head, 1, sizeof(head), file) == sizeof(head) && fclose(file) == 0);
    CHECK(memcmp(head, "\x89PNG\r\n\x1a\n", 8) == 0 && head[19] == WIDTH && head[23] == HEIGHT);
    /* It replaces a picture, but not a dataset. */
    OK(vcp_view_save_png(view, path));
    CHECK(vcp_view_save_png(view, tree) == VCP_IO && vcp_view_save_png(view, "/nowhere/a.png") == VCP_IO);
    OK(vcp_view_set_lines(view, NULL, 0));
    OK(vcp_view_settle(view, 60));
    read_frame(view, rgba, depth);
    CHECK(memcmp(rgba, both, sizeof(both)) == 0);
    OK(vcp_view_destroy(view));
    OK(vcp_view_destroy(other));
    OK(vcp_context_destroy(context));
}

/* A scene file shows what the same datasets, camera, light and section set by calls show. */
static void scenes(void) {
    build_ball(0);
    static char text[12288];
    const char* name = strrchr(tree, '/') + 1;
    snprintf(text, sizeof(text),
             "{\"datasets\": [{\"file\": \"%s\"}, {\"file\": \"%s\", \"transform\": [[0.5, 0, 0, 3], [0, 0.5, 0, 0], "
             "[0, 0, 0.5, 0], [0, 0, 0, 1]]}], \"lights\": [{\"direction\": [0, 1, 0]}],"
             "\"camera\": {\"position\": [0, 0, 5], \"target\": [0, 0, 0]}, \"sections\": [{\"normal\": [1, 0, 0], "
             "\"offset\": 0.1}]}",
             name, name);
    write_scene(text);
    vcp_context* context = make_context(NULL);
    vcp_view* view = make_view(context);
    OK(vcp_context_open(context, scene, NULL));
    vcp_view* later = make_view(context);
    vcp_look look = VCP_INIT(vcp_look), plain = VCP_INIT(vcp_look);
    OK(vcp_view_get_look(later, &look));
    CHECK(look.section_count == 1 && look.sections[0][3] == 0.1 && look.light_in_world && look.light[1] > 0.999f);
    static uint8_t a[4 * PIXELS], b[4 * PIXELS];
    static float depth[PIXELS];
    OK(vcp_view_settle(view, 60));
    OK(vcp_view_settle(later, 60));
    read_frame(view, a, depth);
    CHECK(isinf(depth[PIXELS / 2 + WIDTH / 2 - 4]) && isfinite(depth[PIXELS / 2 + WIDTH / 2 + 8]));
    read_frame(later, b, depth);
    CHECK(memcmp(a, b, sizeof(a)) == 0);
    /* Surroundings come and go, and leave the scene's lights as they are. */
    OK(vcp_view_set_environment(later, "studio", 30, 1));
    OK(vcp_view_settle(later, 60));
    read_frame(later, b, depth);
    CHECK(memcmp(a, b, sizeof(a)) != 0);
    OK(vcp_view_set_environment(later, NULL, 0, 0));
    OK(vcp_view_settle(later, 60));
    read_frame(later, b, depth);
    CHECK(memcmp(a, b, sizeof(a)) == 0);

    vcp_context* by_calls = make_context(NULL);
    vcp_view* other = make_view(by_calls);
    open_two(by_calls);
    OK(vcp_view_get_look(other, &plain));
    OK(vcp_view_set_look(other, &look));
    look_from(other, 0);
    OK(vcp_view_settle(other, 60));
    read_frame(other, b, depth);
    CHECK(memcmp(a, b, sizeof(a)) == 0);
    OK(vcp_view_destroy(other));
    OK(vcp_context_destroy(by_calls));

    /* What was wrong leaves what is open. */
    write_scene("{\n\"datasets\": [{\"flie\": 1}]}");
    CHECK(vcp_context_open(context, scene, NULL) == VCP_INVALID_INPUT &&
          strstr(vcp_context_last_error(context), "line 2"));
    write_scene("{\"datasets\": [{\"file\": \"none.vcp\"}]}");
    CHECK(vcp_context_open(context, scene, NULL) == VCP_IO && strstr(vcp_context_last_error(context), "none.vcp"));
    snprintf(text, sizeof(text), "{\"datasets\": [{\"file\": \"%s\"}]}", strrchr(ply, '/') + 1);
    write_scene(text);
    CHECK(vcp_context_open(context, scene, NULL) == VCP_INVALID_INPUT);
    write_scene("{\"mesostructure\": [{\"asset\": \"bumps\"}]}");
    CHECK(vcp_context_open(context, scene, NULL) != VCP_OK);
    OK(vcp_view_settle(view, 60));
    read_frame(view, b, depth);
    CHECK(memcmp(a, b, sizeof(a)) == 0);

    /* A surface without a dataset. */
    write_scene("{\"mesostructure\": [{\"asset\": \"hemispheres\", \"tiles\": 2}]}");
    OK(vcp_context_open(context, scene, NULL));
    vcp_dataset_info info = VCP_INIT(vcp_dataset_info);
    OK(vcp_context_dataset(context, &info));
    CHECK(info.datasets == 0 && info.bounds_max[0] > 0.9);
    OK(vcp_view_settle(view, 60));
    read_frame(view, b, depth);
    CHECK(isfinite(depth[PIXELS / 2 + WIDTH / 2]));
    vcp_pick relief = VCP_INIT(vcp_pick);
    OK(vcp_view_pick(view, WIDTH / 2 + 0.5, HEIGHT / 2 + 0.5, &relief));
    CHECK(relief.hit == 1 && relief.dataset == VCP_NO_DATASET && relief.error > 0 && relief.error < 1e-3);
    CHECK(fabs(relief.distance - depth[PIXELS / 2 + WIDTH / 2]) < 1e-3 * relief.distance);

    /* What comes next is lit and cut as it would be without. */
    OK(vcp_context_open(context, tree, NULL));
    OK(vcp_view_get_look(view, &look));
    CHECK(memcmp(&look, &plain, sizeof(look)) == 0);
    OK(vcp_view_destroy(view));
    OK(vcp_view_destroy(later));
    OK(vcp_context_destroy(context));
}

/* Made and destroyed again and again: VCP_TEST_CYCLES times. */
static void cycles(void) {
    build_ball(0);
    const char* wanted = getenv("VCP_TEST_CYCLES");
    const int count = wanted ? atoi(wanted) : 20;
    CHECK(count > 0);
    vcp_context* shared = make_context(NULL);
    OK(vcp_context_open(shared, tree, NULL));
    for (int i = 0; i < count; ++i) {
        vcp_context* own = i % 2 ? make_context(NULL) : NULL;
        if (own) OK(vcp_context_open(own, tree, NULL));
        vcp_view* view = make_view(own ? own : shared);
        vcp_step step = VCP_INIT(vcp_step);
        /* Destroyed before anything is loaded, while it loads, or when it is settled and drawn. */
        if (i % 3 == 1) OK(vcp_view_update(view, &step));
        if (i % 10 == 2) OK(vcp_view_settle(view, 60));
        OK(vcp_view_destroy(view));
        OK(vcp_context_destroy(own));
    }
    OK(vcp_context_destroy(shared));
}

static pthread_mutex_t turn = PTHREAD_MUTEX_INITIALIZER;
static vcp_context* handed;
static vcp_view* contended;

/* A context of the thread's own, and one that goes from thread to thread. */
static void* work(void* unused) {
    (void)unused;
    vcp_context* own = make_context(NULL);
    OK(vcp_context_open(own, tree, NULL));
    vcp_view* view = make_view(own);
    OK(vcp_view_settle(view, 60));
    OK(vcp_view_destroy(view));
    OK(vcp_context_destroy(own));
    for (int i = 0; i < 3; ++i) {
        CHECK(pthread_mutex_lock(&turn) == 0);
        view = make_view(handed);
        OK(vcp_view_settle(view, 60));
        OK(vcp_view_destroy(view));
        CHECK(pthread_mutex_unlock(&turn) == 0);
    }
    /* Out of turn: done or refused, never anything else. */
    for (int i = 0; i < 200; ++i) {
        const vcp_status status = vcp_view_resize(contended, (uint32_t)i + 1, 8);
        CHECK(status == VCP_BUSY || status == VCP_OK);
    }
    return NULL;
}

static void threads(void) {
    build_ball(0);
    handed = make_context(NULL);
    vcp_context* disputed = make_context(NULL);
    contended = make_view(disputed);
    OK(vcp_context_open(handed, tree, NULL));
    pthread_t all[3];
    for (int i = 0; i < 3; ++i) CHECK(pthread_create(&all[i], NULL, work, NULL) == 0);
    for (int i = 0; i < 3; ++i) CHECK(pthread_join(all[i], NULL) == 0);
    OK(vcp_context_destroy(handed));
    OK(vcp_view_destroy(contended));
    OK(vcp_context_destroy(disputed));
}

int main(int argc, char** argv) {
    static const struct {
        const char* name;
        void (*run)(void);
    } cases[] = {{"picture", picture},         {"input", input},     {"callbacks", callbacks}, {"progress", progress},
                 {"wrong_calls", wrong_calls}, {"sharing", sharing}, {"rays", device_rays},    {"placed", placed},
                 {"scenes", scenes},           {"looks", looks},     {"opening", opening},     {"layers", layers},
                 {"cycles", cycles},           {"threads", threads}};
    if (argc != 3) return 2;
    snprintf(ply, sizeof(ply), "%s/ball-%s.ply", argv[2], argv[1]);
    snprintf(tree, sizeof(tree), "%s/ball-%s.vcp", argv[2], argv[1]);
    snprintf(scene, sizeof(scene), "%s/scene-%s.json", argv[2], argv[1]);
    /* Kept to the end, so that the driver stays loaded and leak checkers know its name. */
    static vcp_context* probe = NULL;
    if (vcp_context_create(NULL, &probe) != VCP_OK) return 77;
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); ++i)
        if (strcmp(cases[i].name, argv[1]) == 0) return cases[i].run(), 0;
    return 2;
}
