# docker build --tag fstop .
# openssl rand -hex 32 > token && chmod 444 token
# docker run --rm --publish 8080:8080 --volume "$PWD/token:/run/secrets/fstop-token:ro" fstop
#
# Whoever can reach the port needs the token: Authorization: Bearer TOKEN.

FROM debian:12 AS build
WORKDIR /src
# The packages first: this layer stays while only sources change. `dev` holds the list.
COPY dev ./
RUN ./dev setup build web
COPY . .
RUN ./dev build && ./dev web \
 && cmake --install build/release --prefix /opt/fstop --component runtime --strip

FROM debian:12-slim
# The libraries that the program names (objdump -p fstop | grep NEEDED); theirs follow by themselves.
RUN apt-get update \
 && apt-get install --yes --no-install-recommends \
      libboost-url1.81.0 libembree3-3 libfmt9 libnats3.4 libopencv-core406 libopencv-imgproc406 libopenimageio2.4 libspdlog1.10 \
      libsqlite3-0 libssl3 libtbb12 libtinygltf2d libwebp7 zlib1g \
 && rm -rf /var/lib/apt/lists/* \
 && useradd --uid 10001 --user-group --no-create-home --home-dir /var/lib/fstop --shell /usr/sbin/nologin fstop \
 && install --directory --owner=fstop --group=fstop /var/lib/fstop
COPY --from=build /opt/fstop /opt/fstop
# Ends the build where a library is missing.
RUN /opt/fstop/bin/fstop --help >/dev/null
# By number, so that an orchestrator can see that it is not root.
USER 10001:10001
WORKDIR /var/lib/fstop
VOLUME /var/lib/fstop
EXPOSE 8080
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s \
  CMD ["/opt/fstop/bin/fstop", "probe", "--port", "8080"]
ENTRYPOINT ["/opt/fstop/bin/fstop"]
CMD ["serve", "--address", "0.0.0.0", "--port", "8080", "--data-dir", "/var/lib/fstop", \
     "--token-file", "/run/secrets/fstop-token"]
