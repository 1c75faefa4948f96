/* vcp.h: the viewer of .vcp files as a part of your own program, in C.
 *
 *   vcp_context   a device, its budgets and a dataset, or several in their places; as many as you like, independent
 *                 of each other
 *   vcp_view      a picture of what the context has open: in a window of yours, in your memory or in your Vulkan
 *                 image; the views of a context share its device, its budgets and what is read
 *
 *   vcp_context_create(&options, &context);          vcp_context_open(context, "statue.vcp", NULL);
 *   vcp_view_create(context, &viewOptions, &view);
 *   each time round:
 *     vcp_view_mouse_move(view, x, y); ...           what happened; vcp_view_resize, vcp_view_key, ...
 *     vcp_view_update(view, &step);                  never waits: takes in what was read, says what to do
 *     if (step.draw) vcp_view_render(view);          draws, and shows it in the window
 *     wait for events, at most step.wait_seconds
 *   vcp_view_destroy(view);                          vcp_context_destroy(context);
 *
 * Structs begin with struct_size, which you set to sizeof the struct: VCP_INIT(vcp_step) does. All else may be zero,
 * and is then what the comment says. A pointer to an options struct may be NULL: all of it is zero.
 *
 * Errors: every function returns a vcp_status; no call aborts, prints, exits, or writes outside the paths it was given,
 * and no exception leaves one. What went wrong is a line of text: vcp_context_last_error, vcp_view_last_error, or the
 * error_text of the options where there is no handle yet. A handle or a pointer that is needed and NULL gives
 * VCP_USAGE; a handle that was destroyed must not be used.
 *
 * Threads: calls for a context and its views come one at a time, from any threads; a call that comes while another is
 * under way does nothing but give VCP_BUSY. So do calls from within a callback. Different contexts may be used in
 * different threads at once. vcp_build and vcp_version need no context and may be called from any thread. Callbacks
 * come from within a call of yours, in its thread, and must not throw. There is no global state.
 *
 * Texts are UTF-8. Pixels have their origin at the upper left, y down. Lengths are in the dataset's own unit; of
 * several datasets, in that of the world that they are placed in. */
#ifndef VCP_H
#define VCP_H

#include <stddef.h>
#include <stdint.h>

#if defined(VCP_BUILDING) && defined(__GNUC__)
#define VCP_API __attribute__((visibility("default")))
#else
#define VCP_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* vcp_step step = VCP_INIT(vcp_step); */
#define VCP_INIT(type) \
    { .struct_size = sizeof(type) }

typedef struct vcp_context vcp_context;
typedef struct vcp_view vcp_view;

typedef int32_t vcp_status;
enum {
    VCP_OK = 0,
    VCP_INVALID_INPUT = 1, /* the bytes of a file are wrong */
    VCP_IO = 2,            /* open, read, write, no space, no connection */
    VCP_UNSUPPORTED = 3,   /* valid, but of a version or kind that this library does not know */
    VCP_LIMIT = 4,         /* a budget or a limit is too small for it */
    VCP_DEVICE = 5,        /* Vulkan: no device, out of memory, lost */
    VCP_USAGE = 6,         /* a wrong call: what it asks for makes no sense */
    VCP_CANCELLED = 7,     /* you asked to stop, or the time was over */
    VCP_BUSY = 8,          /* another call for this context is under way */
    VCP_OUT_OF_MEMORY = 9,
    VCP_INTERNAL = 10 /* a defect of the library */
};

/* The status in a word or two; never NULL. */
VCP_API const char* vcp_status_text(vcp_status status);
/* The version of the library, such as "0.1.0". */
VCP_API const char* vcp_version(void);

/* ---- Context ---- */

typedef int32_t vcp_log_level;
enum { VCP_LOG_INFO = 0, VCP_LOG_WARNING = 1, VCP_LOG_ERROR = 2 };

/* Functions that the context calls. Each may be NULL. */
typedef struct vcp_callbacks {
    uint32_t struct_size;
    void* user; /* your pointer, handed back */
    void (*log)(void* user, vcp_log_level level, const char* text);
    /* A call failed; `text` is what last_error says. Like the text of `log`, it lives until the callback returns. */
    void (*error)(void* user, vcp_status status, const char* text);
    /* The view's picture would differ: update it soon. Called from calls that change the view, and from updates of
     * other views that share its pages. */
    void (*needs_redraw)(void* user, vcp_view* view);
    /* An update found nothing missing, loading or queued, for the first time since it was otherwise. */
    void (*settled)(void* user, vcp_view* view);
} vcp_callbacks;

/* A Vulkan device of yours. It must outlive the context and have Vulkan 1.2, and its instance must have been made for
 * that version; no feature is needed. For views in windows it needs VK_KHR_swapchain. A lost device is not made anew:
 * calls give VCP_DEVICE from then on. */
typedef struct vcp_host_device {
    uint32_t struct_size;
    uint32_t queue_family; /* it can compute; for windows and images it must have graphics too */
    struct VkInstance_T* instance;
    struct VkPhysicalDevice_T* physical_device;
    struct VkDevice_T* device;
    struct VkQueue_T* queue; /* used within calls for this context, in their thread; you may not use it then */
} vcp_host_device;

typedef struct vcp_context_options {
    uint32_t struct_size;
    uint32_t windows; /* 1: views may have windows */
    /* Index, or a part of the name; NULL: the best one, and where that is a software device, the processor casts rays
     * itself and leaves to the device what it does not draw. */
    const char* device;
    const vcp_host_device* host_device; /* NULL: the context makes a device of its own */
    uint64_t gpu_bytes;                 /* budget of the pages on the device, never exceeded; 0: 512 MiB */
    uint64_t ram_bytes;      /* budget of pages being read or kept to be read again, never exceeded; 0: 256 MiB */
    uint32_t loader_threads; /* 0: 2, for what is on a server 8 */
    uint32_t without_colour; /* 1: colours are neither read nor kept */
    const vcp_callbacks* callbacks; /* NULL: none; copied */
    char* error_text;               /* NULL, or a buffer for why there is no context */
    size_t error_text_size;
} vcp_context_options;

VCP_API vcp_status vcp_context_create(const vcp_context_options* options, vcp_context** context);
/* Destroys a context. VCP_USAGE while it has views. While another thread opens something: VCP_BUSY, and that call ends
 * soon, with VCP_CANCELLED; then call again. What is opened in the background is cancelled. NULL: nothing is done. */
VCP_API vcp_status vcp_context_destroy(vcp_context* context);
/* Returns the last error of the context as a line of text; "" when there was none. It lives until the next call.
 * VCP_BUSY leaves it as it is; do not read it while another thread's call is under way. */
VCP_API const char* vcp_context_last_error(const vcp_context* context);

typedef struct vcp_open_options {
    uint32_t struct_size;
    const char* ca_file;      /* PEM of authorities to trust for https; NULL: the system's */
    const char* cache_folder; /* keeps what a server sends; NULL: nothing is kept */
    uint64_t cache_bytes;     /* limit of the folder; 0: 4 GiB */
} vcp_open_options;

/* Opens a .vcp file, or its http:// or https:// address, and shows all of it in all views, in place of what was open. A
 * mesh is built first: vcp_build. When it fails nothing is open, or what was open before.
 *
 * A path that ends in .json is a scene file (docs/scenes.md): all its datasets and surfaces are shown where it places
 * them, and its camera, light, section planes and caps, where it has any, go to all views, those that are made later
 * too. What is opened next takes a scene's light and planes away again. */
VCP_API vcp_status vcp_context_open(vcp_context* context, const char* path, const vcp_open_options* options);

/* A dataset in its place. */
typedef struct vcp_placed {
    uint32_t struct_size; /* the same in all of an array */
    uint32_t reserved;
    const char* path;              /* a .vcp file, or its address */
    double world_from_dataset[16]; /* a matrix, row by row, for columns (x, y, z, 1): turns, moves, and scales all axes
                                    * by one number; all zero: where it lies by itself */
} vcp_placed;

/* Opens `count` datasets, 1 to 256, and shows them together, as vcp_context_open does one. Each gets a share of the
 * budgets and at least one loader thread. VCP_USAGE where a matrix mirrors, shears, stretches one axis more than
 * another, moves by more than 1e12 or scales by more than 1e9 or less than 1e-9. */
VCP_API vcp_status vcp_context_open_placed(vcp_context* context, const vcp_placed* datasets, uint32_t count,
                                           const vcp_open_options* options);

/* Opening without waiting: what is open stays, and is shown, until the new is there.
 *   vcp_context_start_open(context, path, NULL);
 *   each time round:
 *     vcp_opening opening = VCP_INIT(vcp_opening);
 *     status = vcp_context_opening(context, &opening);
 *     opening.under_way: show opening.fraction, and go on; else it is there, or status says why not */
typedef struct vcp_opening {
    uint32_t struct_size;
    uint32_t under_way; /* 1: something is being opened */
    uint32_t datasets;  /* number of datasets in it; 0: not known yet */
    uint32_t opened;    /* number of those that are open by now */
    double fraction;    /* opened / datasets, 0 to 1 */
    char file[256];     /* the dataset that is opened now, without its folder; may be cut off */
} vcp_opening;

/* Begins what vcp_context_open and vcp_context_open_placed do, in a thread of the library's, and returns at once. What
 * was being opened before is cancelled, by those two calls as well. VCP_USAGE as they say; all other errors come with
 * vcp_context_opening. */
VCP_API vcp_status vcp_context_start_open(vcp_context* context, const char* path, const vcp_open_options* options);
VCP_API vcp_status vcp_context_start_open_placed(vcp_context* context, const vcp_placed* datasets, uint32_t count,
                                                 const vcp_open_options* options);
/* Says how far it is, without waiting for a disk or a server. The call that finds it done shows it in all views, or
 * returns the error that ended it, and then what was open before stays open; later calls find nothing under way. */
VCP_API vcp_status vcp_context_opening(vcp_context* context, vcp_opening* opening);
/* Ends what is being opened soon: vcp_context_opening then gives VCP_CANCELLED. */
VCP_API vcp_status vcp_context_cancel_opening(vcp_context* context);

typedef struct vcp_dataset_info {
    uint32_t struct_size;
    uint32_t levels;
    uint64_t triangles;
    double bounds_min[3], bounds_max[3];
    double cell;            /* edge of the finest cells */
    double certified_error; /* certified error of the finest level: it is at most so far from the mesh */
    uint32_t datasets;      /* number of open datasets */
    uint32_t reserved;
} vcp_dataset_info;

/* Describes all that is open together, in the world: most levels, all triangles, the box about all, the smallest cell,
 * the largest error. VCP_USAGE where nothing is open. */
VCP_API vcp_status vcp_context_dataset(vcp_context* context, vcp_dataset_info* info);

typedef struct vcp_device_info {
    uint32_t struct_size;
    uint32_t software; /* 1: a processor does all of the work */
    char name[256];
} vcp_device_info;
VCP_API vcp_status vcp_context_device(vcp_context* context, vcp_device_info* info);

/* Sets other budgets, from now on; 0: as it is. VCP_LIMIT where the coarsest page has no room: all stays as it was. */
VCP_API vcp_status vcp_context_set_budgets(vcp_context* context, uint64_t gpu_bytes, uint64_t ram_bytes);
/* Waits until something was read, nothing is left to read, or the time is over; while something is being opened, until
 * that is done. */
VCP_API vcp_status vcp_context_wait(vcp_context* context, double seconds);

/* ---- View ---- */

typedef int32_t vcp_window_system;
enum {
    VCP_WINDOW_NONE = 0,     /* frames for your memory or your image */
    VCP_WINDOW_CALLBACK = 1, /* create_surface makes the surface, as glfwCreateWindowSurface does */
    VCP_WINDOW_XCB = 2,      /* display: xcb_connection_t*, window: xcb_window_t */
    VCP_WINDOW_XLIB = 3,     /* display: Display*, window: Window */
    VCP_WINDOW_WAYLAND = 4   /* display: wl_display*, window: wl_surface* */
};

typedef struct vcp_view_options {
    uint32_t struct_size;
    vcp_window_system window_system; /* the context was made with windows = 1, or on your device */
    void* display;
    uint64_t window;
    /* Makes a VkSurfaceKHR, which the view destroys; not VK_SUCCESS (0): the view is not made. Called by
     * vcp_view_create, and again when a lost device is made anew. */
    int32_t (*create_surface)(void* user, struct VkInstance_T* instance, uint64_t* surface);
    void* create_surface_user;
    uint32_t width, height; /* pixels of the framebuffer; 0: minimized */
    double moving_frame_ms; /* while the camera moves, frames that would take longer are drawn smaller; 0: never */
    double move_seconds;    /* time that a smooth move takes; 0: at once */
    uint32_t z_is_up;       /* 0: y is up */
    char* error_text;       /* NULL, or a buffer for why there is no view */
    size_t error_text_size;
} vcp_view_options;

VCP_API vcp_status vcp_view_create(vcp_context* context, const vcp_view_options* options, vcp_view** view);
/* Destroys a view; call it before its window is destroyed. NULL: nothing is done. */
VCP_API vcp_status vcp_view_destroy(vcp_view* view);
/* Returns the view's last error, as vcp_context_last_error does the context's. */
VCP_API const char* vcp_view_last_error(const vcp_view* view);

/* Sets the size in pixels of the framebuffer, at most 16384 a side; 0: minimized, nothing is drawn. */
VCP_API vcp_status vcp_view_resize(vcp_view* view, uint32_t width, uint32_t height);

typedef int32_t vcp_button;
enum { VCP_LEFT = 0, VCP_MIDDLE = 1, VCP_RIGHT = 2 };
enum { VCP_SHIFT = 1, VCP_CONTROL = 2 };

/* Left: orbits about what is under the cursor; with shift, or other buttons: pans; with control: turns the light. */
VCP_API vcp_status vcp_view_mouse_press(vcp_view* view, vcp_button button, double x, double y, uint32_t modifiers);
VCP_API vcp_status vcp_view_mouse_move(vcp_view* view, double x, double y);
VCP_API vcp_status vcp_view_mouse_release(vcp_view* view, vcp_button button);
/* Zooms to what is under the cursor, in when positive; with shift: moves the section planes. */
VCP_API vcp_status vcp_view_mouse_scroll(vcp_view* view, double x, double y, double notches, uint32_t modifiers);

typedef int32_t vcp_action;
enum {
    VCP_FIT = 0,          /* fits all of the dataset into the picture */
    VCP_RESET = 1,        /* goes back to the view it opened with */
    VCP_TOGGLE_LIGHT = 2, /* the light follows the camera, or stays */
    VCP_TOGGLE_SHADOWS = 3,
    VCP_TOGGLE_OCCLUSION = 4,
    VCP_TOGGLE_SECTION = 5, /* cuts through the middle */
    VCP_NEXT_SHADING = 6,
    VCP_TOGGLE_PROJECTION = 7,
    VCP_TOGGLE_COLOUR = 8,
    VCP_TOGGLE_UP_AXIS = 9,
    VCP_TOGGLE_FLY = 10,
    VCP_VIEW_FRONT = 11,
    VCP_VIEW_RIGHT = 12,
    VCP_VIEW_TOP = 13,
    VCP_VIEW_ISOMETRIC = 14,
    VCP_CENTRE = 15 /* what was last under the cursor moves to the middle */
};
VCP_API vcp_status vcp_view_act(vcp_view* view, vcp_action action);
/* A key of a keyboard, as the character on it in capitals: what it does in the window of `vcp view` (F fit, R reset, M
 * shading, G fly with W A S D E Q, ...). Others do nothing. */
VCP_API vcp_status vcp_view_key(vcp_view* view, uint32_t key, uint32_t pressed);

/* position, target and up are in the dataset's coordinates; with several datasets, in the world's. */
typedef struct vcp_camera {
    uint32_t struct_size;
    uint32_t orthographic; /* 1: parallel rays; the height shown is that at the target */
    double position[3];
    double target[3]; /* what orbiting turns about where nothing is under the cursor */
    double up[3];     /* zero: the up axis */
    double fov_y;     /* full vertical angle in radians; 0: 45 degrees */
} vcp_camera;

VCP_API vcp_status vcp_view_get_camera(vcp_view* view, vcp_camera* camera);
/* Sets the camera. VCP_USAGE, and nothing changes, where a number is not finite, target is at the position, up is along
 * the view, or fov_y is not between 1e-5 and 3.12. */
VCP_API vcp_status vcp_view_set_camera(vcp_view* view, const vcp_camera* camera);
/* Moves the camera there smoothly; errors as for vcp_view_set_camera. */
VCP_API vcp_status vcp_view_move_camera(vcp_view* view, const vcp_camera* camera);

typedef int32_t vcp_shading;
enum {
    VCP_SHADING_LIT = 0,
    VCP_SHADING_CLAY = 1,
    VCP_SHADING_UNLIT = 2,
    VCP_SHADING_NORMALS = 3,
    VCP_SHADING_STEPS = 4, /* false colours: work of the rays */
    VCP_SHADING_CELLS = 5,
    VCP_SHADING_FETCHES = 6,
    VCP_SHADING_LEVEL = 7, /* false colours: level and certified error of what was hit */
    VCP_SHADING_ERROR = 8,
    VCP_SHADING_WIREFRAME = 9 /* clay with the edges of triangles and leaves */
};

/* How things look. With all zero it is the usual look: lit, by a light that follows the camera, before a grey that
 * grows darker upwards. Get it, change it, set it; or set one of VCP_INIT. */
typedef struct vcp_look {
    uint32_t struct_size;
    vcp_shading shading;
    double error_pixels;     /* certified error at which refining ends, in pixels; 0: half a pixel */
    uint32_t shadows;        /* 1: hard shadows */
    uint32_t occlusion_rays; /* rays a pixel and sample, at most 64; 0: no ambient occlusion */
    double occlusion_radius; /* 0: a tenth of the diagonal */
    uint32_t light_in_world; /* 0: the light follows the camera */
    uint32_t transparent;    /* 1: the background is black with alpha 0, edges have alpha between */
    float light[3];          /* towards the light; camera axes (right, up, back), or world; zero: from the upper left */
    float background_top[3], background_bottom[3]; /* linear, 0 to 1; both zero: the usual (black: 1e-6) */
    uint32_t section_count;                        /* at most 6 planes; what lies beyond them is cut away */
    double sections[6][4];                         /* n, d: what has dot(n, x) >= d is kept */
    /* Rays a pixel of a picture at rest, 1 to 64, whose light is averaged: smooth edges. 0, and from the beginning: 16,
     * and 64 where the view has a window. Pictures in motion, false colours and normals have one. */
    uint32_t samples;
    /* 1: what the planes cut open of closed parts is filled, and open surfaces show as lines; 2: all is filled as if it
     * were closed, as it is where a file does not say which parts are */
    uint32_t section_caps;
    /* ΔE, 100 for black and white: where slabs' colours differ by more from what they stand for, detail is read until
     * they are no larger than error_pixels; 0: 6; 100: colours do not count */
    double colour_error;
    uint32_t plain; /* 1: plain light, also where materials have normals, roughness, metalness or emission */
    uint32_t reserved;
} vcp_look;

VCP_API vcp_status vcp_view_get_look(vcp_view* view, vcp_look* look);
VCP_API vcp_status vcp_view_set_look(vcp_view* view, const vcp_look* look);

/* Lights the view from everywhere, in place of its lights, which stay as they are: "studio", "overcast", "clear", or a
 * picture of the surroundings, equirectangular (.hdr, .exr), which takes up to some seconds to read. `turn_degrees`:
 * the surroundings are turned about the axis that points up, to the left as seen from above; `strength`: 0 to 10 times
 * their usual light. NULL: the view's lights light it again. What is opened next takes it away. Errors: VCP_USAGE,
 * VCP_IO, VCP_INVALID_INPUT (damaged, black), VCP_UNSUPPORTED, VCP_LIMIT (above 8192 x 4096); then nothing changes. */
VCP_API vcp_status vcp_view_set_environment(vcp_view* view, const char* source, float turn_degrees, float strength);

/* Shows (1) or hides (0) a dataset in this view, by its number in the order in which they were placed. What is hidden
 * is neither drawn, loaded nor picked; surfaces with mesostructure stay. What is opened next is shown. VCP_USAGE where
 * there is no such dataset. */
VCP_API vcp_status vcp_view_set_visible(vcp_view* view, uint32_t dataset, uint32_t visible);
VCP_API vcp_status vcp_view_is_visible(vcp_view* view, uint32_t dataset, uint32_t* visible);

/* A line from point to point, painted over the picture: nothing hides it. */
typedef struct vcp_line {
    uint32_t struct_size; /* the same in all of an array */
    uint32_t point_count;
    const double* points; /* x, y, z of each point, in the world */
    float colour[4];      /* red, green, blue, opacity, 0 to 1, as on screens (sRGB); all zero: white */
    float width;          /* in pixels of the view; 0: 2 */
    uint32_t reserved;
} vcp_line;

/* Paints these lines over the view's pictures, wherever they go, in place of those before; copied. Depth and picks know
 * nothing of them. Pictures with lines pass through the processor's memory, which takes some milliseconds each.
 * VCP_USAGE where a number is not finite or out of its range. */
VCP_API vcp_status vcp_view_set_lines(vcp_view* view, const vcp_line* lines, uint32_t count);

typedef struct vcp_step {
    uint32_t struct_size;
    uint32_t draw;    /* 1: vcp_view_render is due */
    uint32_t settled; /* 1: nothing that the view wants is missing, loading or queued */
    uint32_t reserved;
    double wait_seconds; /* come back after this time even if nothing happens; infinity: nothing is going on */
} vcp_step;

VCP_API vcp_status vcp_view_update(vcp_view* view, vcp_step* step);
/* Draws what the last update chose, where that differs from the last picture, or a part of a further sample of it;
 * shows it in the view's window. Waits for the GPU, never for a file. */
VCP_API vcp_status vcp_view_render(vcp_view* view);
/* Updates until nothing is missing and nothing moves, then renders, with all samples. VCP_CANCELLED when it takes
 * longer than `seconds`; what there is then is rendered. */
VCP_API vcp_status vcp_view_settle(vcp_view* view, double seconds);

/* The last picture. While the camera moves, frames may be drawn smaller; then it is smaller than the view. */
typedef struct vcp_frame {
    uint32_t struct_size;
    uint32_t width, height; /* written */
    uint32_t reserved;
    uint8_t* rgba;     /* NULL, or room for the picture: upper row first, no padding, sRGB-encoded */
    size_t rgba_size;  /* bytes */
    float* depth;      /* NULL, or room: distance from the eye along each pixel's ray; infinity: nothing is hit */
    size_t depth_size; /* floats */
} vcp_frame;

/* VCP_USAGE where nothing was rendered yet; VCP_LIMIT, with width and height written, where the room is too small. */
VCP_API vcp_status vcp_view_read(vcp_view* view, vcp_frame* frame);

/* Writes the last picture as a PNG of RGBA, which appears whole or not at all, in place of a PNG of that name.
 * VCP_USAGE where nothing was rendered yet; VCP_IO where the file cannot be written, or is of another kind. */
VCP_API vcp_status vcp_view_save_png(vcp_view* view, const char* path);

/* An image on your device: colour, one sample, a UNORM format, with usage TRANSFER_DST. */
typedef struct vcp_host_image {
    uint32_t struct_size;
    int32_t layout_after; /* VkImageLayout; 0: SHADER_READ_ONLY_OPTIMAL */
    uint64_t image;       /* VkImage */
    uint32_t width, height;
    uint64_t wait;   /* VkSemaphore that is signalled before the image is written, or 0 */
    uint64_t signal; /* VkSemaphore to signal when it is written, or 0 */
} vcp_host_image;

/* Copies the last picture into your image, scaled to it; what was in the image is lost. */
VCP_API vcp_status vcp_view_copy_to_image(vcp_view* view, const vcp_host_image* image);

/* The dataset of a pick on a surface with mesostructure. */
#define VCP_NO_DATASET 0xFFFFFFFFu

typedef struct vcp_pick {
    uint32_t struct_size;
    uint32_t hit; /* 0: nothing is there, and the rest is zero */
    double position[3];
    double normal[3]; /* unit, towards the eye */
    double distance;  /* from the origin of the eye's ray */
    double error;     /* certified error: the mesh is at most so far from `position`'s surface; on mesostructure what is
                         known of its method, and infinite where nothing is */
    uint32_t level;   /* level of the page that was hit: the finest there is; 0 on mesostructure */
    /* Number of the dataset that was hit, in the order in which they were placed, or VCP_NO_DATASET. */
    uint32_t dataset;
} vcp_pick;

/* Finds what is at a point of the picture, on the finest level and in double precision, whatever is drawn. Reads what
 * it needs from the file or the server, so it may wait. Remeshed surfaces are not found. */
VCP_API vcp_status vcp_view_pick(vcp_view* view, double x, double y, vcp_pick* pick);

/* Statistics of the last update and the last picture. */
typedef struct vcp_stats {
    uint32_t struct_size;
    uint32_t settled, drawable;
    uint32_t relaxed;       /* 1: the budget is too small for the look's error_pixels */
    uint32_t reduction;     /* the picture has 1/reduction of the width and height */
    uint32_t device_losses; /* device losses that were repaired */
    uint64_t frames;        /* frames rendered so far; each sample of a picture is one */
    double frame_ms;
    double error_pixels; /* largest projected certified error in the picture */
    uint64_t rays, hit_pixels;
    uint64_t resident_bytes, pool_bytes, bytes_read;
    uint64_t read_failures; /* reads that failed and were tried again */
    uint32_t pages_resident, pages_drawn, pages_wanted, pages_missing;
    uint32_t coarsest_level, finest_level;
    uint32_t samples;        /* rays a pixel, so far, of the last picture */
    uint32_t detail;         /* limited by 0: loading, 1: nothing, 2: the finest level, 3: the budget */
    uint32_t processor_rays; /* 1: the processor cast the rays of the last picture itself, and no shader ran */
    uint32_t colour_limits;  /* 1: colours err most in the picture, and are refined next; 0: distances */
    double colour_pixels; /* edge of the widest slabs in the picture whose colours are off by more than colour_error */
} vcp_stats;

VCP_API vcp_status vcp_view_stats(vcp_view* view, vcp_stats* stats);

/* ---- Building ---- */

typedef struct vcp_progress {
    uint32_t struct_size;
    const char* stage; /* "reading", "images", "sorting", "level 1 of 6", "writing", "done"; lives until the callback
                          returns */
    double fraction;   /* fraction of the whole, 0 to 1, never less than before; 1: done */
    uint64_t triangles;
    double seconds;
} vcp_progress;

typedef int32_t vcp_colour;
enum {
    VCP_COLOUR_AUTO = 0, /* all that there is */
    VCP_COLOUR_VERTEX = 1,
    VCP_COLOUR_TEXTURE = 2,
    VCP_COLOUR_NONE = 3
};

typedef struct vcp_build_options {
    uint32_t struct_size;
    uint32_t input_count;
    const char* const* inputs; /* meshes: PLY, OBJ, STL, OFF, glTF, GLB, Draco; joined into one dataset */
    const char* output;        /* OUT.vcp: whole or absent */
    const char* temp_folder;   /* NULL: beside the output */
    double cell;               /* finest cell edge; 0: chosen from the mesh */
    double error;              /* tolerated distance to the mesh; 0: the finest level is the mesh */
    uint64_t memory_bytes;     /* cap; 0: a part of what the machine has */
    uint32_t threads;          /* 0: one a processor */
    uint32_t resume;           /* 1: goes on where an interrupted build of the same output was */
    /* Called about ten times a second, and at every stage, in the calling thread. Returning 0 cancels, and then it is
     * not called again. */
    int (*progress)(void* user, const vcp_progress* progress);
    void* user;
    char* error_text;
    size_t error_text_size;
    const char*
        format; /* of meshes whose content does not tell it: "stl", "obj", ...; NULL: the content, then the name */
    vcp_colour colour; /* which colour is kept */
    uint32_t reserved;
} vcp_build_options;

typedef struct vcp_build_report {
    uint32_t struct_size;
    uint32_t levels;
    uint64_t triangles, file_bytes;
    double cell, certified_error, seconds;
} vcp_build_report;

/* Builds a .vcp file. Blocks. `report` may be NULL. */
VCP_API vcp_status vcp_build(const vcp_build_options* options, vcp_build_report* report);

#ifdef __cplusplus
}
#endif
#endif
