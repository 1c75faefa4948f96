/* A library to preload: lets the N-th call that writes fail.
 *
 * Counted are write, pwrite, fsync, fdatasync, rename, ftruncate, mkdir, open and openat with O_CREAT, but not on the
 * standard streams. FAIL_AT: the number of the call, from 1. FAIL_ERRNO: what it fails with. FAIL_ON: if set,
 * all calls after it fail, too, as on a full disk. FAIL_MARK: a file that is made when a call has failed.
 * FAIL_SHORT: instead, every write is interrupted once, and then takes only a part of its bytes.
 * FAIL_FLAGS: renames with flags fail, as on NFS.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <unistd.h>

static atomic_long calls;

static long number(const char* name) {
    const char* text = getenv(name);
    return text ? atol(text) : 0;
}

/* Whether this call is to fail; sets errno. */
static int fails(void) {
    const long at = number("FAIL_AT"), call = ++calls;
    if (at == 0 || call < at || (call > at && !getenv("FAIL_ON"))) return 0;
    const char* mark = getenv("FAIL_MARK");
    if (mark) syscall(SYS_close, (int)syscall(SYS_openat, AT_FDCWD, mark, O_WRONLY | O_CREAT, 0666));
    errno = (int)number("FAIL_ERRNO");
    return 1;
}

/* How many of `count` bytes a write may take; 0: it is interrupted. */
static size_t part(size_t count) {
    static atomic_long writes;
    if (!getenv("FAIL_SHORT")) return count;
    if (++writes % 2) {
        errno = EINTR;
        return 0;
    }
    return count / 3 + 1;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

ssize_t write(int fd, const void* bytes, size_t count) {
    if (fd <= 2) return REAL(write)(fd, bytes, count);
    if (fails() || (count > 0 && (count = part(count)) == 0)) return -1;
    return REAL(write)(fd, bytes, count);
}

ssize_t pwrite(int fd, const void* bytes, size_t count, off_t offset) {
    if (fails() || (count > 0 && (count = part(count)) == 0)) return -1;
    return REAL(pwrite)(fd, bytes, count, offset);
}

ssize_t pwrite64(int fd, const void* bytes, size_t count, off64_t offset) {
    if (fails() || (count > 0 && (count = part(count)) == 0)) return -1;
    return REAL(pwrite64)(fd, bytes, count, offset);
}

int fsync(int fd) { return fails() ? -1 : REAL(fsync)(fd); }
int fdatasync(int fd) { return fails() ? -1 : REAL(fdatasync)(fd); }
int rename(const char* from, const char* to) { return fails() ? -1 : REAL(rename)(from, to); }
int renameat2(int folder, const char* from, int other, const char* to, unsigned flags) {
    if (flags == 0 || !getenv("FAIL_FLAGS")) return REAL(renameat2)(folder, from, other, to, flags);
    /* Linux sees by itself that a name is there. */
    errno = flags == RENAME_NOREPLACE && faccessat(other, to, F_OK, 0) == 0 ? EEXIST : EINVAL;
    return -1;
}
int ftruncate(int fd, off_t size) { return fails() ? -1 : REAL(ftruncate)(fd, size); }
int ftruncate64(int fd, off64_t size) { return fails() ? -1 : REAL(ftruncate64)(fd, size); }
int mkdir(const char* path, mode_t mode) { return fails() ? -1 : REAL(mkdir)(path, mode); }

#define OPEN(name)                                                      \
    int name(const char* path, int flags, ...) {                        \
        va_list rest;                                                   \
        va_start(rest, flags);                                          \
        const mode_t mode = flags & O_CREAT ? va_arg(rest, mode_t) : 0; \
        va_end(rest);                                                   \
        if (flags & O_CREAT && fails()) return -1;                      \
        return REAL(name)(path, flags, mode);                           \
    }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                                    \
    int name(int folder, const char* path, int flags, ...) {            \
        va_list rest;                                                   \
        va_start(rest, flags);                                          \
        const mode_t mode = flags & O_CREAT ? va_arg(rest, mode_t) : 0; \
        va_end(rest);                                                   \
        if (flags & O_CREAT && fails()) return -1;                      \
        return REAL(name)(folder, path, flags, mode);                   \
    }
OPENAT(openat)
OPENAT(openat64)
