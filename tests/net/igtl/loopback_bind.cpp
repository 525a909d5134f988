// Preloaded into OpenIGTLink's example servers, which listen on every interface: makes them listen on the loopback
// only, and print the port.
#include <dlfcn.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdio>
#include <cstring>

extern "C" int bind(int socket, const sockaddr* wanted, socklen_t size) {
  using Bind = int (*)(int, const sockaddr*, socklen_t);
  static const Bind real_bind = reinterpret_cast<Bind>(dlsym(RTLD_NEXT, "bind"));
  if (wanted->sa_family != AF_INET) return real_bind(socket, wanted, size);
  sockaddr_in address{};
  std::memcpy(&address, wanted, sizeof address);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (real_bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return -1;
  socklen_t length = sizeof address;
  if (getsockname(socket, reinterpret_cast<sockaddr*>(&address), &length) != 0) return -1;
  std::printf("bound to port %d\n", ntohs(address.sin_port));
  std::fflush(stdout);
  return 0;
}
