/* Shows brachyd's deforming gland, its needles and seeds: a viewer in plain C and OpenGL, on the C API.
 *
 *   gland_view [HOST [PORT [PICTURE.ppm]]]
 *
 * Esc ends. With PICTURE the first picture of tissue that is displaced by 2 mm is written there, and the program ends. */

#include <GL/freeglut.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <brachyd_client.h>

static BrachydClient* client;
static BrachydTopology topology;
static BrachydFrame frame;
static float* normals; /* 3 a surface vertex */
static float* colours; /* likewise: the further from rest, the redder */
static const char* picture;

static void end_with(const char* problem) {
  fprintf(stderr, "gland_view: %s\n", problem);
  exit(2);
}

static void find_normals(const float* p) {
  memset(normals, 0, 3 * sizeof(float) * topology.surface_vertex_count);
  for (const uint32_t *t = topology.triangles, *end = t + 3 * topology.triangle_count; t < end; t += 3) {
    const float *a = p + 3 * t[0], *b = p + 3 * t[1], *c = p + 3 * t[2];
    const float u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]},
                v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    const float n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    for (int corner = 0; corner < 3; ++corner)
      for (int i = 0; i < 3; ++i) normals[3 * t[corner] + i] += n[i]; /* GL_NORMALIZE makes them unit */
  }
}

static void find_colours(const float* p) {
  for (uint32_t vertex = 0; vertex < topology.surface_vertex_count; ++vertex) {
    const float *now = p + 3 * vertex, *rest = topology.rest_positions + 3 * vertex;
    const float d = sqrtf(powf(now[0] - rest[0], 2) + powf(now[1] - rest[1], 2) + powf(now[2] - rest[2], 2));
    const float red = fminf(d / 4, 1);
    const float colour[3] = {0.75f + 0.2f * red, 0.6f - 0.4f * red, 0.55f - 0.4f * red};
    memcpy(colours + 3 * vertex, colour, sizeof colour);
  }
}

static void draw_gland(void) {
  const float* positions = brachyd_positions(client);
  find_normals(positions);
  find_colours(positions);
  glEnable(GL_LIGHTING);
  glEnableClientState(GL_VERTEX_ARRAY);
  glEnableClientState(GL_NORMAL_ARRAY);
  glEnableClientState(GL_COLOR_ARRAY);
  glVertexPointer(3, GL_FLOAT, 0, positions);
  glNormalPointer(GL_FLOAT, 0, normals);
  glColorPointer(3, GL_FLOAT, 0, colours);
  glDrawElements(GL_TRIANGLES, (GLsizei)(3 * topology.triangle_count), GL_UNSIGNED_INT, topology.triangles);
  glDisableClientState(GL_COLOR_ARRAY);
  glDisable(GL_LIGHTING);
}

static void draw_needles_and_seeds(void) {
  const double length_mm = 150;
  glLineWidth(3);
  glBegin(GL_LINES);
  for (uint32_t i = 0; i < frame.needle_count; ++i) {
    BrachydNeedle needle;
    if (brachyd_get_needle(client, i, &needle) != kBrachydOk || !needle.present) continue;
    const double* X = needle.X_WN; /* its third column is the shaft's direction, its fourth the tip */
    glColor3f(0.9f, 0.9f, 0.95f);
    glVertex3d(X[3], X[7], X[11]);
    glVertex3d(X[3] - length_mm * X[2], X[7] - length_mm * X[6], X[11] - length_mm * X[10]);
  }
  for (uint32_t i = 0; i < frame.seed_count; ++i) {
    BrachydSeed seed;
    if (brachyd_get_seed(client, i, &seed) != kBrachydOk) continue;
    glColor3f(1, 0.8f, 0.2f);
    for (int end = -1; end <= 1; end += 2)
      glVertex3d(seed.position[0] + 2.25 * end * seed.axis[0], seed.position[1] + 2.25 * end * seed.axis[1],
                 seed.position[2] + 2.25 * end * seed.axis[2]);
  }
  glEnd();
}

static void write_picture(void) {
  const int width = glutGet(GLUT_WINDOW_WIDTH), height = glutGet(GLUT_WINDOW_HEIGHT);
  unsigned char* pixels = malloc(3 * (size_t)width * (size_t)height);
  FILE* file = fopen(picture, "wb");
  if (!pixels || !file) end_with("the picture cannot be written");
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, pixels);
  fprintf(file, "P6 %d %d 255\n", width, height);
  for (int row = height - 1; row >= 0; --row) fwrite(pixels + 3 * width * row, 3, (size_t)width, file);
  fclose(file);
  free(pixels);
}

static void draw(void) {
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glMatrixMode(GL_PROJECTION);
  glLoadIdentity();
  gluPerspective(25, (double)glutGet(GLUT_WINDOW_WIDTH) / glutGet(GLUT_WINDOW_HEIGHT), 10, 1000);
  glMatrixMode(GL_MODELVIEW);
  glLoadIdentity();
  /* As the physician looks from the patient's feet, a little from the side: the patient's right is on the left. */
  gluLookAt(-70, 70, -190, 0, 0, 0, 0, 1, 0);
  if (topology.point_count > 0) draw_gland();
  draw_needles_and_seeds();
  if (picture && frame.max_displacement_mm > 2) {
    write_picture();
    glutLeaveMainLoop();
  }
  glutSwapBuffers();
}

static void serve(void) {
  const int news = brachyd_poll(client, 0.02); /* all that has arrived: what is drawn is the last of it */
  if (news < 0) end_with(brachyd_error_text(client));
  if (news & kBrachydNewTopology) {
    brachyd_get_topology(client, &topology);
    normals = realloc(normals, 3 * sizeof(float) * topology.surface_vertex_count);
    colours = realloc(colours, 3 * sizeof(float) * topology.surface_vertex_count);
    if (!normals || !colours) end_with("no memory");
  }
  if (news & kBrachydNewFrame) {
    brachyd_get_frame(client, &frame);
    glutPostRedisplay();
  }
}

static void on_key(unsigned char key, int x, int y) {
  (void)x, (void)y;
  if (key == 27) glutLeaveMainLoop();
}

int main(int argc, char** argv) {
  glutInit(&argc, argv);
  BrachydOptions options;
  brachyd_init_options(&options, sizeof options);
  options.subscription = kBrachydSurface;
  strcpy(options.name, "gland_view");
  client = brachyd_create();
  if (!client) end_with("no memory");
  if (brachyd_connect(client, argc > 1 ? argv[1] : "127.0.0.1", argc > 2 ? atoi(argv[2]) : 18950, &options) <
      0)
    end_with(brachyd_error_text(client));
  picture = argc > 3 ? argv[3] : NULL;
  glutInitDisplayMode(GLUT_DOUBLE | GLUT_RGB | GLUT_DEPTH | GLUT_MULTISAMPLE);
  glutInitWindowSize(800, 600);
  glutCreateWindow("brachyd");
  glutSetOption(GLUT_ACTION_ON_WINDOW_CLOSE, GLUT_ACTION_GLUTMAINLOOP_RETURNS);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_NORMALIZE);
  glEnable(GL_LIGHT0);
  glEnable(GL_COLOR_MATERIAL);
  glutDisplayFunc(draw);
  glutIdleFunc(serve);
  glutKeyboardFunc(on_key);
  glutMainLoop();
  brachyd_destroy(client);
  free(normals);
  free(colours);
  return 0;
}
