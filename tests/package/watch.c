#include <brachyd_client.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char** argv) {
  BrachydClient* client = brachyd_create();
  int status = brachyd_connect(client, "127.0.0.1", argc > 1 ? atoi(argv[1]) : 18950, NULL);
  while ((status = status < 0 ? status : brachyd_poll(client, 1)) >= 0) {
    BrachydFrame frame;
    if (!(status & kBrachydNewFrame) || brachyd_get_frame(client, &frame) != kBrachydOk) continue;
    const float* p = brachyd_positions(client); /* x0 y0 z0 x1 …, mm, patient RAS */
    printf("tick %llu: %u points, the first at %.2f %.2f %.2f mm\n", (unsigned long long)frame.tick,
           (unsigned)frame.point_count, p[0], p[1], p[2]);
  }
  fprintf(stderr, "%s\n", brachyd_error_text(client));
  brachyd_destroy(client);
  return 1;
}
