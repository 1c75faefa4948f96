/* Frames into memory, without a window: offscreen FILE.vcp [OUT.ppm]. Writes the picture and says what is in its
 * middle. */
#include <stdio.h>
#include <stdlib.h>

#include <vcp/vcp.h>

enum { WIDTH = 640, HEIGHT = 480 };

static int failed(const char* what, const char* why) {
    fprintf(stderr, "%s: %s\n", what, why);
    return EXIT_FAILURE;
}

static int write_ppm(const char* path, const uint8_t* rgba) {
    FILE* file = fopen(path, "wb");
    if (!file) return failed(path, "cannot be written");
    fprintf(file, "P6 %d %d 255\n", WIDTH, HEIGHT);
    for (int i = 0; i < WIDTH * HEIGHT; ++i) fwrite(rgba + 4 * i, 1, 3, file);
    return fclose(file) == 0 ? EXIT_SUCCESS : failed(path, "cannot be written");
}

static int show(vcp_view* view, const char* out) {
    static uint8_t rgba[4 * WIDTH * HEIGHT];
    static float depth[WIDTH * HEIGHT];
    vcp_frame frame = VCP_INIT(vcp_frame);
    frame.rgba = rgba;
    frame.rgba_size = sizeof(rgba);
    frame.depth = depth;
    frame.depth_size = WIDTH * HEIGHT;
    vcp_pick pick = VCP_INIT(vcp_pick);
    if (vcp_view_settle(view, 60) || vcp_view_read(view, &frame) || vcp_view_pick(view, WIDTH / 2, HEIGHT / 2, &pick))
        return failed("no frame", vcp_view_last_error(view));
    if (pick.hit)
        printf("in the middle: %.9g %.9g %.9g, within %.2g; %.6g from the eye\n", pick.position[0], pick.position[1],
               pick.position[2], pick.error, depth[HEIGHT / 2 * WIDTH + WIDTH / 2]);
    return out ? write_ppm(out, rgba) : EXIT_SUCCESS;
}

int main(int argc, char** argv) {
    if (argc < 2) return failed("usage", "offscreen FILE.vcp [OUT.ppm]");
    char why[256] = "";
    vcp_context_options options = VCP_INIT(vcp_context_options);
    options.error_text = why;
    options.error_text_size = sizeof(why);
    vcp_context* context = NULL;
    if (vcp_context_create(&options, &context)) return failed("no context", why);

    vcp_view_options size = VCP_INIT(vcp_view_options);
    size.width = WIDTH;
    size.height = HEIGHT;
    vcp_view* view = NULL;
    int status;
    if (vcp_context_open(context, argv[1], NULL) || vcp_view_create(context, &size, &view))
        status = failed("cannot show", vcp_context_last_error(context));
    else
        status = show(view, argc > 2 ? argv[2] : NULL);
    vcp_view_destroy(view);
    vcp_context_destroy(context);
    return status;
}
