/* The client of scripts/conformance/README.md on the C API: HOST PORT ROLE [TOKEN]. Prints what it receives. */

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "brachyd_client.h"

static void print_text(const char* text) {
  putchar('"');
  for (; *text; ++text) {
    if (*text == '"' || *text == '\\') putchar('\\');
    putchar(*text);
  }
  putchar('"');
}

/* 64-bit FNV-1a over the points' bytes, which are little-endian on the machines that we know. */
static uint64_t checksum(const float* positions, size_t count) {
  const unsigned char* bytes = (const unsigned char*)positions;
  uint64_t value = UINT64_C(0xcbf29ce484222325);
  for (size_t i = 0; i < count * sizeof *positions; ++i) value = (value ^ bytes[i]) * UINT64_C(0x100000001b3);
  return value;
}

/* The tracker's pose number k: a straight needle; in some of them it has lost the needle. */
static void track(int k, double X_WN[12]) {
  const double depth = -30 + 0.25 * (k < 240 ? k : 240);
  const double pose[12] = {1, 0, 0, k % 50 == 10 || k % 50 == 11 ? NAN : 5, 0, 1, 0, 0, 0, 0, 1, depth};
  memcpy(X_WN, pose, sizeof pose);
}

static void print_news(BrachydClient* client, int news) {
  BrachydTopology topology;
  if ((news & kBrachydNewTopology) && brachyd_get_topology(client, &topology) == kBrachydOk)
    printf("{\"topology\": {\"hash\": \"%016" PRIx64 "\", \"points\": %u, \"triangles\": %u}}\n",
           topology.hash, (unsigned)topology.point_count, (unsigned)topology.triangle_count);
  BrachydFrame frame;
  if ((news & kBrachydNewFrame) && brachyd_get_frame(client, &frame) == kBrachydOk)
    printf("{\"frame\": {\"tick\": %" PRIu64 ", \"mesh\": \"%016" PRIx64 "\"}}\n", frame.tick,
           checksum(brachyd_positions(client), 3 * (size_t)frame.point_count));
  BrachydForce force;
  if ((news & kBrachydNewForce) && brachyd_get_force(client, &force) == kBrachydOk)
    printf("{\"force\": {\"input_stamp_ns\": %" PRId64 ", \"force_n\": [%.17g, %.17g, %.17g]}}\n",
           force.input_stamp_ns, force.force_n[0], force.force_n[1], force.force_n[2]);
  BrachydEvent event;
  while (brachyd_next_event(client, &event) == kBrachydOk) {
    printf("{\"event\": {\"kind\": %u, \"text\": ", (unsigned)event.kind);
    print_text(event.text);
    printf("}}\n");
  }
  BrachydError error;
  while (brachyd_next_error(client, &error) == kBrachydOk) {
    printf("{\"error\": {\"code\": %u, \"fatal\": %d, \"text\": ", (unsigned)error.code, (int)error.fatal);
    print_text(error.text);
    printf("}}\n");
  }
}

int main(int argc, char** argv) {
  BrachydOptions options;
  brachyd_init_options(&options, sizeof options);
  BrachydClient* client = brachyd_create();
  if (argc < 4 || !client) return 2;
  strcpy(options.name, "conformance in C");
  if (strcmp(argv[3], "device") == 0) {
    options.role = kBrachydDevice;
    options.subscription = kBrachydNoMesh;
  }
  for (size_t i = 0; argc > 4 && i < kBrachydTokenBytes; ++i) {
    unsigned byte = 0;
    sscanf(argv[4] + 2 * i, "%2x", &byte);
    options.token[i] = (uint8_t)byte;
    options.has_token = 1;
  }
  int status = brachyd_connect(client, argv[1], atoi(argv[2]), &options);
  BrachydWelcome welcome;
  int64_t interval_ns = 10 * 1000 * 1000;
  if (brachyd_get_welcome(client, &welcome) == kBrachydOk) {
    printf("{\"welcome\": {\"role\": %d, \"needle\": %u, \"server\": ", (int)welcome.role,
           (unsigned)welcome.needle);
    print_text(welcome.server);
    printf("}}\n");
    const int64_t least_ns = welcome.max_poses_per_s ? 1000000000 / welcome.max_poses_per_s : interval_ns;
    if (least_ns > interval_ns) interval_ns = least_ns;
  }
  int64_t next_ns = brachyd_now_ns();
  int is_latched = 0;
  for (int k = 0; status >= 0;) {
    const int64_t left_ns = next_ns - brachyd_now_ns();
    fflush(stdout);
    status = brachyd_poll(client, options.role != kBrachydDevice ? 0.5
                                  : left_ns > 0                  ? 1e-9 * (double)left_ns
                                                                 : 0);
    print_news(client, status > 0 ? status : 0);
    BrachydForce force;
    if (brachyd_get_force(client, &force) == kBrachydOk) {
      if ((force.flags & kBrachydForceLatched) && !is_latched) brachyd_arm(client, force.needle);
      is_latched = (force.flags & kBrachydForceLatched) != 0;
    }
    if (options.role == kBrachydDevice && status >= 0 && brachyd_now_ns() >= next_ns) {
      double X_WN[12];
      track(k++, X_WN);
      next_ns = brachyd_now_ns() + interval_ns;
      brachyd_send_pose(client, X_WN, 0); /* refuses what is no number, and sends nothing then */
    }
  }
  print_news(client, 0);
  printf("{\"closed\": ");
  print_text(brachyd_error_text(client));
  printf("}\n");
  brachyd_destroy(client);
  return 0;
}
