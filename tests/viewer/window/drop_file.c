// Preloaded into vcp view: drops the file whose name stands in the file $VCP_TEST_DROP, by the very callback that GLFW
// calls when a file is dropped into the window.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef void (*DropCallback)(void* window, int count, const char** paths);

static void* theWindow;
static DropCallback theCallback;

DropCallback glfwSetDropCallback(void* window, DropCallback callback) {
    theWindow = window;
    theCallback = callback;
    DropCallback (*real)(void*, DropCallback);
    *(void**)&real = dlsym(RTLD_NEXT, "glfwSetDropCallback");
    return real(window, callback);
}

static void dropWhatIsThere(void) {
    char path[4096];
    const char* name = getenv("VCP_TEST_DROP");
    FILE* file = name && theCallback ? fopen(name, "r") : NULL;
    if (!file) return;
    const char* line = fgets(path, sizeof path, file);
    fclose(file);
    remove(name);
    if (!line) return;
    path[strcspn(path, "\n")] = 0;
    theCallback(theWindow, 1, &line);
}

static void waitFor(double seconds) {
    void (*real)(double);
    *(void**)&real = dlsym(RTLD_NEXT, "glfwWaitEventsTimeout");
    real(seconds);
    dropWhatIsThere();
}

void glfwWaitEvents(void) { waitFor(0.2); }
void glfwWaitEventsTimeout(double seconds) { waitFor(seconds < 0.2 ? seconds : 0.2); }
