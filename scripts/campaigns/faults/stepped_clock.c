/* Preloaded into brachyd by the case "attack": its wall clock, and no other clock, is ahead by as many seconds as the
 * file CLOCK_STEPS holds, an int64. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

static int (*real)(clockid_t, struct timespec*);
static const volatile int64_t* ahead_s;

__attribute__((constructor)) static void open_steps(void) {
  const char* name = getenv("CLOCK_STEPS");
  const int file = name ? open(name, O_RDONLY | O_CLOEXEC) : -1;
  void* map = file < 0 ? MAP_FAILED : mmap(NULL, sizeof *ahead_s, PROT_READ, MAP_SHARED, file, 0);
  if (file >= 0) close(file);
  *(void**)&real = dlsym(RTLD_NEXT, "clock_gettime");
  if (map != MAP_FAILED) ahead_s = map;
}

int clock_gettime(clockid_t clock, struct timespec* now) {
  const int result = real ? real(clock, now) : (int)syscall(SYS_clock_gettime, clock, now);
  if (clock == CLOCK_REALTIME && ahead_s) now->tv_sec += *ahead_s;
  return result;
}

time_t time(time_t* out) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  if (out) *out = now.tv_sec;
  return now.tv_sec;
}

int gettimeofday(struct timeval* out, void* zone) {
  struct timespec now;
  (void)zone;
  clock_gettime(CLOCK_REALTIME, &now);
  out->tv_sec = now.tv_sec;
  out->tv_usec = now.tv_nsec / 1000;
  return 0;
}
