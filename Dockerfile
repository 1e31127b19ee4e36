# One image with the three programs, linked statically, and nothing else: 1 file system layer, no shell.
#
#   docker build -t cpf .
#   docker run --rm cpf mission-control --help
#
# Both base images can be changed, for a mirror, or where a shell inside the containers is wanted:
#   docker build --build-arg RUNTIME=debian:bookworm-slim -t cpf .
# No `# syntax=` line and no `RUN --mount`: the file also builds without BuildKit, and without fetching a front end.
ARG BUILDER=rust:1.95-bookworm
ARG RUNTIME=scratch

FROM ${BUILDER} AS build
# `dev` builds in less than half the time; its programs are slower.
ARG PROFILE=release
WORKDIR /src
COPY . .
# Naming the target, though it is the builder's own, keeps crt-static away from build scripts and procedural macros, which
# cannot be static. glibc, linked statically, looks host names up in /etc/hosts and by DNS, which is all a container has.
# /image becomes the root of the image. Its /logs is open to every user, as /tmp would be, so that any `user:` can log.
RUN set -eu; \
    target="$(rustc -vV | sed -n 's/^host: //p')"; \
    RUSTFLAGS="-C target-feature=+crt-static" cargo build --locked --profile "$PROFILE" --target "$target" \
        --package network-emulator --package vehicle-node --package mission-control --bins; \
    mkdir -p /image/usr/local/bin /image/logs; \
    chmod 1777 /image/logs; \
    cd target/"$target"/*/; \
    cp network-emulator vehicle-node mission-control /image/usr/local/bin/; \
    rm -rf /src/target

FROM ${RUNTIME}
COPY --from=build /image /
# Nothing here needs a privilege. A number, for there is no /etc/passwd to look a name up in.
USER 10001:10001
WORKDIR /fleet
ENV CPF_LOGS=/logs
STOPSIGNAL SIGTERM
CMD ["mission-control", "--help"]
