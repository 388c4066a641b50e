/* A libController for tests: each function asks the fake Webots at the other end of a Unix socket.

   As in Webots' library, one lock serves all functions: while a thread waits in wb_robot_step, all others wait.
   The environment variable FAKE_WEBOTS names the socket. A request is its length, the name of the function,
   a byte 0 and the arguments; a response is its length and the result. All numbers are little-endian.

   arguments: i int32 | d double | s length, bytes | v count, doubles | n count, int32s | p pointer
   results: the same without the letter; a text or an array of length -1 is NULL */

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

typedef unsigned short tag;
typedef int number;
typedef double real;
typedef bool flag;
typedef const char *text;
typedef void *ref;
typedef void none;
typedef const int *ints;
typedef const double *vec2, *vec3, *vec4, *vec6, *doubles;
typedef const float *floats;
typedef const unsigned char *bytes;
typedef struct { float x, y, z; int layer_id; float time; } Point;
typedef struct { double distance, received_power, speed, azimuth; } Target;
typedef struct { double point[3]; int node_id, padding; } Contact;
typedef struct {
  int id;
  double position[3], orientation[4], size[2];
  int position_on_image[2], size_on_image[2], number_of_colors;
  double *colors;
  char *model;
} Object;
typedef const Point *points;
typedef const Target *targets;
typedef const Object *objects;
typedef Contact *contacts;

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int connection = -1;
static bool quitting = false;
static unsigned char *buffer = NULL;
static uint32_t used = 0, room = 0, at = 0;

/* An array that a function returns stays valid for a while, as in Webots; older ones are freed. */
enum { KEPT = 512 };
static void *kept[KEPT];
static unsigned next_kept = 0;

static void *keep(size_t size) {
  void **place = &kept[next_kept++ % KEPT];
  free(*place);
  *place = calloc(1, size ? size : 1);
  return *place;
}

static void put(const void *data, uint32_t size) {
  while (used + size > room)
    buffer = realloc(buffer, room = room ? 2 * room : 4096);
  memcpy(buffer + used, data, size);
  used += size;
}

static void put_counted(char kind, const void *data, uint32_t count, uint32_t size) {
  put(&kind, 1);
  put(&count, 4);
  put(data, count * size);
}

static void put_number(int value) {
  put("i", 1);
  put(&value, 4);
}

static void put_real(double value) {
  put("d", 1);
  put(&value, 8);
}

static void put_ref(void *value) {
  uint64_t pointer = (uint64_t)value;
  put("p", 1);
  put(&pointer, 8);
}

static void put_text(const char *value) { put_counted('s', value, strlen(value), 1); }
static void put_tag(tag value) { put_number(value); }
static void put_flag(bool value) { put_number(value); }
static void put_vec2(const double *value) { put_counted('v', value, 2, 8); }
static void put_vec3(const double *value) { put_counted('v', value, 3, 8); }
static void put_vec4(const double *value) { put_counted('v', value, 4, 8); }
static void put_vec6(const double *value) { put_counted('v', value, 6, 8); }

static void transfer(void *data, size_t size, bool sending) {
  for (size_t done = 0; done < size;) {
    ssize_t count = sending ? send(connection, (char *)data + done, size - done, MSG_NOSIGNAL)
                            : recv(connection, (char *)data + done, size - done, 0);
    if (count <= 0)
      _exit(1); /* Webots has ended */
    done += count;
  }
}

static void begin(const char *name) {
  pthread_mutex_lock(&lock);
  if (quitting)
    exit(0); /* as Webots' library, after a step has returned -1 */
  used = 4;
  if (room == 0)
    buffer = malloc(room = 4096);
  put(name, strlen(name) + 1);
}

static void ask(void) {
  uint32_t size = used - 4;
  memcpy(buffer, &size, 4);
  transfer(buffer, used, true);
  transfer(&size, 4, false);
  used = at = 0;
  while (size > room)
    buffer = realloc(buffer, room *= 2);
  transfer(buffer, size, false);
}

static void take(void *data, size_t size) {
  memcpy(data, buffer + at, size);
  at += size;
}

static void release(void) { pthread_mutex_unlock(&lock); }

static int take_number(void) {
  int value;
  take(&value, 4);
  return value;
}

static void *take_counted(size_t size, int *count) {
  *count = take_number();
  if (*count < 0)
    return NULL;
  char *data = keep((*count + 1) * size); /* a text ends with a byte 0 */
  take(data, *count * size);
  return data;
}

static void end_none(void) {
  ask();
  release();
}

static int end_number(void) {
  ask();
  int value = take_number();
  release();
  return value;
}

static tag end_tag(void) { return end_number(); }
static bool end_flag(void) { return end_number() != 0; }

static double end_real(void) {
  double value;
  ask();
  take(&value, 8);
  release();
  return value;
}

static void *end_ref(void) {
  uint64_t pointer;
  ask();
  take(&pointer, 8);
  release();
  return (void *)pointer;
}

static void *end_array(size_t size) {
  int count;
  ask();
  void *data = take_counted(size, &count);
  release();
  return data;
}

static text end_text(void) { return end_array(1); }
static doubles end_doubles(void) { return end_array(8); }
static floats end_floats(void) { return end_array(4); }
static bytes end_bytes(void) { return end_array(1); }
static points end_points(void) { return end_array(sizeof(Point)); }
static targets end_targets(void) { return end_array(sizeof(Target)); }

static objects end_objects(void) {
  int count, size;
  ask();
  count = take_number();
  Object *found = keep((count + 1) * sizeof(Object));
  for (int i = 0; i < count; i++) {
    take(&found[i].id, 4);
    take(found[i].position, 9 * 8); /* position, orientation and size */
    take(found[i].position_on_image, 4 * 4);
    found[i].colors = take_counted(8, &size);
    found[i].number_of_colors = size / 3;
    found[i].model = take_counted(1, &size);
  }
  release();
  return found;
}

/* clang-format off */
#define F0(result, name) result wb_##name(void) { begin(#name); return end_##result(); }
#define F1(result, name, A) result wb_##name(A a) { begin(#name); put_##A(a); return end_##result(); }
#define F2(result, name, A, B) result wb_##name(A a, B b) { begin(#name); put_##A(a); put_##B(b); return end_##result(); }
#define F3(result, name, A, B, C) result wb_##name(A a, B b, C c) { begin(#name); put_##A(a); put_##B(b); put_##C(c); return end_##result(); }
#define F4(result, name, A, B, C, D) result wb_##name(A a, B b, C c, D d) { \
  begin(#name); put_##A(a); put_##B(b); put_##C(c); put_##D(d); return end_##result(); }
#define F5(result, name, A, B, C, D, E) result wb_##name(A a, B b, C c, D d, E e) { \
  begin(#name); put_##A(a); put_##B(b); put_##C(c); put_##D(d); put_##E(e); return end_##result(); }
#define F7(result, name, A, B, C, D, E, F, G) result wb_##name(A a, B b, C c, D d, E e, F f, G g) { \
  begin(#name); put_##A(a); put_##B(b); put_##C(c); put_##D(d); put_##E(e); put_##F(f); put_##G(g); return end_##result(); }
#define F8(result, name, A, B, C, D, E, F, G, H) result wb_##name(A a, B b, C c, D d, E e, F f, G g, H h) { \
  begin(#name); put_##A(a); put_##B(b); put_##C(c); put_##D(d); put_##E(e); put_##F(f); put_##G(g); put_##H(h); return end_##result(); }
/* clang-format on */

#include "functions.h"

static void polygon(const char *name, tag device, ints x, ints y, int size) {
  begin(name);
  put_tag(device);
  put_counted('n', x, size, 4);
  put_counted('n', y, size, 4);
  put_number(size);
  end_none();
}

void wb_display_draw_polygon(tag device, ints x, ints y, int size) { polygon("display_draw_polygon", device, x, y, size); }
void wb_display_fill_polygon(tag device, ints x, ints y, int size) { polygon("display_fill_polygon", device, x, y, size); }

ref wb_display_image_new(tag device, int width, int height, const void *data, int format) {
  begin("display_image_new");
  put_tag(device);
  put_number(width);
  put_number(height);
  put_counted('s', data, width * height * (format == 3 ? 3 : 4), 1);
  put_number(format);
  return end_ref();
}

int wb_emitter_send(tag device, const void *data, int size) {
  begin("emitter_send");
  put_tag(device);
  put_counted('s', data, size, 1);
  return end_number();
}

void wb_robot_wwi_send(const char *data, int size) {
  begin("robot_wwi_send");
  put_counted('s', data, size, 1);
  end_none();
}

contacts wb_supervisor_node_get_contact_points(ref node, bool descendants, int *size) {
  begin("supervisor_node_get_contact_points");
  put_ref(node);
  put_flag(descendants);
  ask();
  contacts found = take_counted(sizeof(Contact), size);
  release();
  return found;
}

int wb_robot_init(void) {
  const char *path = getenv("FAKE_WEBOTS"), *name = getenv("WEBOTS_ROBOT_NAME");
  struct sockaddr_un address = {.sun_family = AF_UNIX};
  if (path == NULL || name == NULL)
    exit(1);
  strncpy(address.sun_path, path, sizeof(address.sun_path) - 1);
  connection = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (connect(connection, (struct sockaddr *)&address, sizeof(address)) != 0)
    exit(1);
  begin("robot_init");
  put_text(name);
  return end_number();
}

void wb_robot_cleanup(void) {}

int wb_robot_step(int duration) {
  begin("robot_step");
  put_number(duration);
  ask();
  int delay = take_number();
  quitting = delay == -1;
  release();
  return delay;
}
