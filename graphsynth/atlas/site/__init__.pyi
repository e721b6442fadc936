from .building import SiteReport as SiteReport, build_site as build_site
