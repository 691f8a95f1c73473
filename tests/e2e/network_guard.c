/* Preloaded into every process of a test: writes down each attempt to reach another computer. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static void write_down(const char *call, const char *where)
{
    char line[512];
    const char *path = getenv("NETWORK_LOG");
    int log = path ? open(path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600) : -1;
    if (log < 0)
        return;
    int length = snprintf(line, sizeof line, "%s %s\n", call, where);
    if (write(log, line, (size_t)length) != length)
        abort();
    close(log);
}

static void look(const char *call, const struct sockaddr *to)
{
    char text[INET6_ADDRSTRLEN] = "";
    if (to == NULL)
        return;
    if (to->sa_family == AF_INET) {
        const struct in_addr *address = &((const struct sockaddr_in *)to)->sin_addr;
        if (ntohl(address->s_addr) >> 24 != 127)
            write_down(call, inet_ntop(AF_INET, address, text, sizeof text));
    } else if (to->sa_family == AF_INET6) {
        const struct in6_addr *address = &((const struct sockaddr_in6 *)to)->sin6_addr;
        if (!IN6_IS_ADDR_LOOPBACK(address))
            write_down(call, inet_ntop(AF_INET6, address, text, sizeof text));
    }
}

int connect(int fd, const struct sockaddr *to, socklen_t size)
{
    int (*real)(int, const struct sockaddr *, socklen_t) = dlsym(RTLD_NEXT, "connect");
    look("connect", to);
    return real(fd, to, size);
}

ssize_t sendto(int fd, const void *data, size_t length, int flags, const struct sockaddr *to,
               socklen_t size)
{
    ssize_t (*real)(int, const void *, size_t, int, const struct sockaddr *, socklen_t) =
        dlsym(RTLD_NEXT, "sendto");
    look("sendto", to);
    return real(fd, data, length, flags, to, size);
}

int getaddrinfo(const char *name, const char *service, const struct addrinfo *hints,
                struct addrinfo **found)
{
    int (*real)(const char *, const char *, const struct addrinfo *, struct addrinfo **) =
        dlsym(RTLD_NEXT, "getaddrinfo");
    if (name != NULL && strcmp(name, "localhost") != 0)
        write_down("getaddrinfo", name);
    return real(name, service, hints, found);
}
