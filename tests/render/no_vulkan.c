/* A library to preload: the machine has no Vulkan loader. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <string.h>

void* dlopen(const char* file, int flags) {
    if (file && strstr(file, "libvulkan")) return NULL;
    return ((__typeof__(&dlopen))dlsym(RTLD_NEXT, "dlopen"))(file, flags);
}
