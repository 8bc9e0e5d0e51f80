# The page in a container: docker build -t himpc-lab . && docker run --rm -p 8080:8080 himpc-lab
FROM python:3.12-slim
COPY . /tmp/himpc-lab
# Only C++ compilers read the headers (195 MB). The first run compiles the controllers, so that no start has to.
RUN cd /tmp/himpc-lab \
    && pip install --no-cache-dir -c constraints.txt ".[meshes]" \
    && rm -rf /tmp/himpc-lab "$(python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/cmeel.prefix/include" \
    && cd / && himpc-lab run iiwa14-hold --duration 0.01
RUN useradd --create-home learner
USER learner
WORKDIR /home/learner
EXPOSE 8080
ENTRYPOINT ["himpc-lab", "--host", "0.0.0.0", "--port", "8080"]
