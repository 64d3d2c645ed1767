# docker build -t handout . ; see docs/desk.md
FROM python:3.13-slim AS build
COPY pyproject.toml README.md LICENSE /src/
COPY handout /src/handout
COPY handout_lab /src/handout_lab
COPY devices /src/devices
COPY calibration /src/calibration
COPY styles /src/styles
COPY poses /src/poses
COPY brushes /src/brushes
# left out: the tests of libraries, their C sources, sample pictures and data, and a report on tests that colour-science
# 0.4.7 carries along (76 MB)
RUN python -m venv /opt/handout \
 && /opt/handout/bin/pip install --no-cache-dir --no-compile "/src[excel,network,pdf]" \
 && /opt/handout/bin/pip uninstall --yes pip \
 && cd /opt/handout/lib/python3.13/site-packages \
 && find . -type d -name tests -prune -exec rm -r {} + \
 && find . -type f \( -name '*.pyx' -o -name '*.pxd' -o -name '*.[cha]' -o -name '*.hpp' -o -name '*.lib' \) -delete \
 && find skimage/data sklearn/datasets -type f -size +20k ! -name '*.py*' -delete \
 && rm -rf colour/htmlcov
# whether all is whole, and what letters and plots need compiled beforehand
RUN cd /tmp \
 && /opt/handout/bin/handout doctor \
 && /opt/handout/bin/handout write "compiled" -o a.png -o a.pdf \
 && /opt/handout/bin/handout plot --port sim: "too"

FROM python:3.13-slim
COPY --from=build /opt/handout /opt/handout
# a home that any --user may write; a volume there keeps hands, settings, calibrations and jobs
RUN mkdir -m 1777 /home/handout
ENV PATH=/opt/handout/bin:$PATH HOME=/home/handout
VOLUME /home/handout
WORKDIR /work
ENTRYPOINT ["handout"]
CMD ["--help"]
