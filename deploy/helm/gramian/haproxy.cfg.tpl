{{- $name := include "gramian.name" . }}
{{- $places := include "gramian.places" . | int }}
{{- $domain := printf "%s-replicas.%s.svc.%s" $name .Release.Namespace .Values.clusterDomain -}}
# The router: all requests about one cloud go to one replica, which has what was computed from it. If that
# replica is gone, the next one on the ring takes over and reads the cloud from the shared store. The same
# text as deploy/haproxy/haproxy.cfg but for the replicas; a test compares them.

global
    log stdout format raw local0 info
    maxconn 1000
    # A request that fits the buffer can be sent again to another replica, one that is larger streams and
    # cannot: the client repeats it. 256 KiB are some ten thousand numbers in JSON. Memory: two buffers for
    # each connection at most, 512 MiB.
    tune.bufsize 262144
    # Requests that are under way when the router is told to end have the deadline of the server and 40 s.
    hard-stop-after {{ add .Values.deadlineSeconds 40 }}s
    stats socket /tmp/haproxy.sock mode 600 level admin

defaults
    mode http
    log global
    option httplog
    option dontlognull
    timeout connect 2s
    # The server's deadline is {{ .Values.deadlineSeconds }} s, and it lets a client read for 30 s after it
    # fell behind.
    timeout server {{ add .Values.deadlineSeconds 30 }}s
    timeout client {{ add .Values.deadlineSeconds 30 }}s
    # From the first byte of a request to the end of its body, or to a full buffer: 256 KiB at the 16 KiB/s
    # that the server wants.
    timeout http-request 30s
    timeout http-keep-alive 60s
    timeout queue 30s
    # Waits for the body before a replica is chosen, so that there is something to send again.
    option http-buffer-request
    # Who leaves is told to the replica: else it computes to the end for nobody, in a place and a lane that
    # others wait for.
    option abortonclose
    # Repeating does no harm: clouds are named by their content, all else computes or deletes. Only a POST
    # with `Prefer: respond-async` makes a second job. 503 is a replica that ends, or one whose queue is full:
    # another one may have room. Nothing is repeated after a timeout: the replica is busy with it. Once, and
    # elsewhere: a request that ends the process that computes it would end the whole fleet with more.
    retry-on conn-failure empty-response junk-response 503
    retries 1
    option redispatch 1

resolvers dns
    parse-resolv-conf
    resolve_retries 3
    timeout resolve 1s
    timeout retry 1s
    hold valid 5s
    hold nx 5s

frontend gramian
    # TLS belongs here: bind :8443 ssl crt /etc/haproxy/gramian.pem alpn h2,http/1.1
    bind :8080
    # The router's own health, for whoever is in front: as long as one replica is there.
    monitor-uri /router/health
    monitor fail if { nbsrv(by_cloud) lt 1 }
    # Metrics need no key, so they are not for everybody; Prometheus asks the replicas themselves.
    http-request deny deny_status 404 if { path /metrics }
    # The cloud: as the header says, or the path.
    http-request set-var(txn.cloud) req.hdr(Gramian-Cloud)
    http-request set-var(txn.cloud) path,field(4,/) if { path_beg /v1/clouds/ } !{ var(txn.cloud) -m len gt 0 }
    use_backend by_cloud if { var(txn.cloud) -m len gt 0 }
    default_backend any

# Requests that name their cloud. Most of the ring stays where it is when a replica comes or goes: the hash is
# consistent. The weight is what makes it even: 100 gives each replica 1,600 places on the ring.
backend by_cloud
    balance hash var(txn.cloud)
    hash-type consistent sdbm avalanche
    option httpchk
    http-check send meth GET uri /health/ready ver HTTP/1.1 hdr Host gramian
    http-check expect status 200
    # A replica whose queue is full for a moment keeps its clouds: it takes five failed checks, 10 s, to lose
    # them. One that does not take connections loses them after three requests, each of which was sent
    # elsewhere at once. maxconn leaves 100 of the 1,000 connections that a replica takes to probes and
    # Prometheus.
    default-server weight 100 maxconn {{ div 450 .Values.router.replicas }} check inter 2s fall 5 rise 1 observe layer4 error-limit 3 on-error mark-down
    default-server resolvers dns init-addr last,libc,none pool-purge-delay 10s
{{- range until $places }}
    server {{ $name }}-{{ . }} {{ $name }}-{{ . }}.{{ $domain }}:8080
{{- end }}

# Requests that name none: registrations of new clouds, points in the body, lists. To whoever has least to do.
backend any
    balance leastconn
    default-server weight 100 maxconn {{ div 450 .Values.router.replicas }} resolvers dns init-addr last,libc,none pool-purge-delay 10s
{{- range until $places }}
    server {{ $name }}-{{ . }} {{ $name }}-{{ . }}.{{ $domain }}:8080 track by_cloud/{{ $name }}-{{ . }}
{{- end }}

frontend metrics
    bind :8404
    http-request use-service prometheus-exporter if { path /metrics }
    http-request deny deny_status 404
