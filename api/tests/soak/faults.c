/* A machine that fails, for a program that is preloaded with it: clocks that are set, disks with errors, and power cuts.
 *
 *   FAULTS_DATA     directory whose files are watched
 *   FAULTS_DURABLE  directory that gets a file's content when it is synced: what a power cut leaves
 *   FAULTS_RULES    file with lines "OPERATION ERRNO N": every Nth read, write or sync of a watched file fails
 *   FAULTS_CLOCK    file with the seconds by which the clock is ahead
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

/* The content of a small file, read by system calls alone. */
static int content(const char *variable, char *text, int size)
{
    const char *path = getenv(variable);
    if (!path)
        return 0;
    int fd = syscall(SYS_openat, AT_FDCWD, path, O_RDONLY | O_CLOEXEC, 0);
    if (fd < 0)
        return 0;
    int n = syscall(SYS_read, fd, text, size - 1);
    syscall(SYS_close, fd);
    text[n < 0 ? 0 : n] = 0;
    return n > 0;
}

/* The name of a watched path in its directory, or none. */
static const char *watched(const char *path)
{
    const char *data = getenv("FAULTS_DATA");
    size_t n = data ? strlen(data) : 0;
    return n && !strncmp(path, data, n) && path[n] == '/' ? path + n + 1 : NULL;
}

static const char *watched_fd(int fd, char *path)
{
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = readlink(link, path, PATH_MAX - 1);
    if (n < 0)
        return NULL;
    path[n] = 0;
    return watched(path);
}

/* The error of this operation, or 0. */
static int fault(const char *operation, int fd)
{
    static unsigned counts[3];
    char rules[256], path[PATH_MAX];
    if (!content("FAULTS_RULES", rules, sizeof rules) || !watched_fd(fd, path))
        return 0;
    char *rest, *line = strtok_r(rules, "\n", &rest);
    for (; line; line = strtok_r(NULL, "\n", &rest)) {
        char name[16];
        int number;
        unsigned every;
        if (sscanf(line, "%15s %d %u", name, &number, &every) != 3 || strcmp(name, operation))
            continue;
        unsigned *count = &counts[*operation == 'r' ? 0 : *operation == 'w' ? 1 : 2];
        if (__atomic_add_fetch(count, 1, __ATOMIC_RELAXED) % every == 0)
            return number;
    }
    return 0;
}

#define NEXT(name) __typeof__(name) *next = dlsym(RTLD_NEXT, #name)

#define FAIL(operation, fd)                                                                                            \
    do {                                                                                                               \
        int number = fault(operation, fd);                                                                             \
        if (number) {                                                                                                  \
            errno = number;                                                                                            \
            return -1;                                                                                                 \
        }                                                                                                              \
    } while (0)

static int durable(const char *name, char *path)
{
    const char *directory = getenv("FAULTS_DURABLE");
    return directory && snprintf(path, PATH_MAX, "%s/%s", directory, name) < PATH_MAX;
}

static void persist(int fd)
{
    char path[PATH_MAX], to[PATH_MAX], bytes[65536];
    const char *name = watched_fd(fd, path);
    struct stat file;
    if (!name || !durable(name, to) || fstat(fd, &file) || !S_ISREG(file.st_mode))
        return;
    pthread_mutex_lock(&lock);
    /* By its path: a descriptor may be for writing alone. */
    int in = syscall(SYS_openat, AT_FDCWD, path, O_RDONLY | O_CLOEXEC, 0);
    int out = syscall(SYS_openat, AT_FDCWD, to, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    off_t at = 0;
    ssize_t n;
    while (in >= 0 && out >= 0 && (n = syscall(SYS_pread64, in, bytes, sizeof bytes, at)) > 0) {
        syscall(SYS_pwrite64, out, bytes, n, at);
        at += n;
    }
    syscall(SYS_ftruncate, out, at);
    syscall(SYS_close, in);
    syscall(SYS_close, out);
    pthread_mutex_unlock(&lock);
}

#define SYNC(name)                                                                                                     \
    int name(int fd)                                                                                                   \
    {                                                                                                                  \
        NEXT(name);                                                                                                    \
        FAIL("sync", fd);                                                                                              \
        persist(fd);                                                                                                   \
        return next(fd);                                                                                               \
    }

SYNC(fsync)
SYNC(fdatasync)

ssize_t write(int fd, const void *bytes, size_t n)
{
    NEXT(write);
    FAIL("write", fd);
    return next(fd, bytes, n);
}

ssize_t pwrite(int fd, const void *bytes, size_t n, off_t at)
{
    NEXT(pwrite);
    FAIL("write", fd);
    return next(fd, bytes, n, at);
}

ssize_t pwrite64(int fd, const void *bytes, size_t n, off64_t at)
{
    NEXT(pwrite64);
    FAIL("write", fd);
    return next(fd, bytes, n, at);
}

ssize_t pread(int fd, void *bytes, size_t n, off_t at)
{
    NEXT(pread);
    FAIL("read", fd);
    return next(fd, bytes, n, at);
}

ssize_t pread64(int fd, void *bytes, size_t n, off64_t at)
{
    NEXT(pread64);
    FAIL("read", fd);
    return next(fd, bytes, n, at);
}

int unlink(const char *path)
{
    NEXT(unlink);
    char to[PATH_MAX];
    const char *name = watched(path);
    if (name && durable(name, to))
        syscall(SYS_unlinkat, AT_FDCWD, to, 0);
    return next(path);
}

int clock_gettime(clockid_t clock, struct timespec *time)
{
    char ahead[64];
    int result = syscall(SYS_clock_gettime, clock, time);
    if (result == 0 && clock == CLOCK_REALTIME && content("FAULTS_CLOCK", ahead, sizeof ahead))
        time->tv_sec += atol(ahead);
    return result;
}
